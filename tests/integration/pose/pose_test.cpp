// Poses over the network, of the simulated rig.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "hapticd/v1/pose.grpc.pb.h"
#include "hapticd/v1/simulation.grpc.pb.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

v1::SubscribePosesRequest wish(double rate_hz, double predict_ms = 0.0,
                               v1::PoseFrame frame = v1::POSE_FRAME_UNSPECIFIED) {
  v1::SubscribePosesRequest request;
  request.set_rate_hz(rate_hz);
  request.set_predict_ms(predict_ms);
  request.set_frame(frame);
  return request;
}

/// One stream of poses, and its end.
class Poses {
 public:
  Poses(const std::shared_ptr<grpc::Channel>& channel, const v1::SubscribePosesRequest& request)
      : stub_(v1::PoseService::NewStub(channel)),
        context_(call_context()),
        reader_(stub_->Subscribe(context_.get(), request)) {}
  ~Poses() { context_->TryCancel(); }
  bool read(v1::Pose& pose) { return reader_->Read(&pose); }
  v1::Pose next() {
    v1::Pose pose;
    EXPECT_TRUE(read(pose)) << "the stream ended";
    return pose;
  }
  grpc::Status finish() { return reader_->Finish(); }

 private:
  std::unique_ptr<v1::PoseService::Stub> stub_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<v1::Pose>> reader_;
};

grpc::Status refused(const RunningService& service, const v1::SubscribePosesRequest& request) {
  Poses poses(service.channel, request);
  v1::Pose pose;
  EXPECT_FALSE(poses.read(pose));
  return poses.finish();
}

TEST(PoseService, ComesAtItsRateInOrderAndStamped) {
  const RunningService service;
  Poses poses(service.channel, wish(50.0));
  v1::Pose last = poses.next();
  EXPECT_EQ(last.frame(), v1::POSE_FRAME_RIG);
  EXPECT_NEAR(std::hypot(last.orientation().w(), last.orientation().x(), last.orientation().y()), 1.0, 0.5);
  EXPECT_FALSE(last.has_in_contact()) << "no scene is loaded";
  EXPECT_FALSE(last.has_displacement_mm());
  std::vector<std::int64_t> steps;
  for (int i = 0; i < 20; ++i) {
    const v1::Pose pose = poses.next();
    EXPECT_GT(pose.tick(), last.tick());
    EXPECT_EQ(pose.sent(), last.sent() + 1);
    ASSERT_TRUE(pose.time().has_daemon_ns());
    EXPECT_GE(pose.handed_over_daemon_ns(), pose.time().daemon_ns() - pose.time().daemon_bound_ns());
    EXPECT_NEAR(
        1e-9 * static_cast<double>(pose.time().utc_ns()),
        static_cast<double>(
            std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count()),
        60.0);
    steps.push_back(pose.time().rig_ns() - last.time().rig_ns());
    last = pose;
  }
  // A machine that stalls makes steps longer, never the usual one.
  std::nth_element(steps.begin(), steps.begin() + 5, steps.end());
  EXPECT_NEAR(1e-6 * static_cast<double>(steps[5]), 20.0, 2.5);
}

TEST(PoseService, SubscribersOfAllRatesAndFramesShareOneRig) {
  const RunningService service;
  Poses fast(service.channel, wish(1000.0));
  Poses slow(service.channel, wish(1.0));
  Poses ahead(service.channel, wish(120.0, 66.0, v1::POSE_FRAME_DEVICE));
  const v1::Pose predicted = ahead.next();
  EXPECT_NEAR(predicted.prediction().ahead_ms(), 66.0, 1e-6);
  EXPECT_EQ(predicted.prediction().order(), 1U);
  EXPECT_GT(predicted.prediction().error_bound_mm(), predicted.prediction().error_mm());
  EXPECT_EQ(predicted.frame(), v1::POSE_FRAME_DEVICE);
  EXPECT_EQ(slow.next().sent(), 1U);
  std::uint64_t tick = fast.next().tick();  // may be the rig's first, which is 0
  for (int i = 1; i < 100; ++i) {
    const v1::Pose pose = fast.next();
    EXPECT_GT(pose.tick(), tick) << "no pose comes twice";
    tick = pose.tick();
  }
}

TEST(PoseService, ATouchIsStampedBeforeItWasNoticed) {
  const RunningService service(config_with_scene("tap_1d"));
  Poses poses(service.channel, wish(200.0));
  service.press(2.0);
  v1::Pose pose = poses.next();
  while (!pose.in_contact()) pose = poses.next();
  const v1::ContactEvent& event = pose.contact();
  EXPECT_GE(event.number(), 1U);
  EXPECT_LE(event.earliest_rig_ns(), event.began().rig_ns());
  EXPECT_LE(event.began().rig_ns(), event.latest_rig_ns());
  EXPECT_LE(event.began().rig_ns(), event.declared_rig_ns());
  EXPECT_LT(event.declared_rig_ns() - event.began().rig_ns(), 60'000'000);
  EXPECT_TRUE(event.began().has_daemon_ns());
  EXPECT_FALSE(event.has_ended_rig_ns());
  ASSERT_TRUE(pose.has_normal());
  EXPECT_NEAR(pose.normal().z(), 1.0, 1e-9);
  EXPECT_TRUE(pose.has_displacement_mm());
  EXPECT_TRUE(pose.has_target_stiffness_n_per_mm());
  EXPECT_TRUE(pose.prediction().normal_is_held());
}

TEST(PoseService, AClientThatDoesNotReadGetsTheNewestAndTheCountOfTheRest) {
  const RunningService service;
  const auto channel = connect(service.address(), Window::kFixed);
  Poses poses(channel, wish(1000.0));
  const v1::Pose first = poses.next();
  // Until the window and the sockets are full and poses are left out.
  Poses other(service.channel, wish(10.0));
  for (int i = 0; i < 40; ++i) other.next();
  v1::Pose pose = first;
  std::uint64_t read = 1;
  const std::uint64_t until = other.next().tick();
  while (pose.tick() < until) {
    pose = poses.next();
    ++read;
    EXPECT_EQ(pose.sent(), read);
  }
  if (pose.skipped() == 0) GTEST_SKIP() << "this machine's sockets hold all of four seconds";
  EXPECT_LE(pose.sent() + pose.skipped(), pose.tick() - first.tick() + 2)
      << "each tick once, sent or skipped";
}

TEST(PoseService, BadRequestsAreRefused) {
  const RunningService service;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double rate : {0.0, 0.5, -1.0, 2000.0, nan, infinity}) {
    expect_refused(refused(service, wish(rate)), grpc::StatusCode::OUT_OF_RANGE,
                   "SubscribePosesRequest.rate_hz");
  }
  for (const double ahead : {-1.0, 500.0, nan, infinity}) {
    expect_refused(refused(service, wish(60.0, ahead)), grpc::StatusCode::OUT_OF_RANGE,
                   "SubscribePosesRequest.predict_ms");
  }
  EXPECT_EQ(refused(service, wish(60.0, 0.0, static_cast<v1::PoseFrame>(99))).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused(service, wish(60.0, 0.0, v1::POSE_FRAME_REFERENCE)).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  v1::SubscribePosesRequest both = wish(60.0, 0.0, v1::POSE_FRAME_REFERENCE);
  both.set_uncorrected(true);
  EXPECT_EQ(refused(service, both).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  Poses still(service.channel, wish(60.0));
  EXPECT_TRUE(still.next().has_position_mm()) << "the service goes on";
}

TEST(PoseService, EndsInWordsWhenTheServiceDoes) {
  RunningService service;
  Poses poses(service.channel, wish(60.0));
  poses.next();
  std::thread ending([&] { service.daemon->shutdown(); });
  v1::Pose pose;
  while (poses.read(pose)) {
  }
  const grpc::Status status = poses.finish();
  ending.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
}

TEST(PoseService, TheLibrarySubscribesAndStateTheRefusal) {
  const RunningService service;
  client::Client client({.address = service.address(), .timeout = std::chrono::milliseconds(kTimeout)});
  client::PoseStream stream = client.subscribe_poses(wish(100.0, 20.0));
  v1::Pose pose;
  ASSERT_EQ(stream.next(pose, kTimeout), client::PoseStream::Event::kMessage);
  EXPECT_NEAR(pose.prediction().ahead_ms(), 20.0, 1e-6);
  stream.cancel();
  client::PoseStream bad = client.subscribe_poses(wish(0.0));
  EXPECT_THROW(while (bad.next(pose, std::chrono::milliseconds(100)) != client::PoseStream::Event::kEnded){},
               client::Error);
}

}  // namespace
}  // namespace hapticd::test
