#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hapticd/v1/calibration.grpc.pb.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/calibration/registration_trial.h"

namespace hapticd::test {
namespace {

server::DaemonConfig uncalibrated() {
  server::DaemonConfig config = quiet_config();
  config.simulation.object = "none";
  config.simulation.conditions = "arm";
  config.simulation.real_time = false;
  config.simulation.speed = 10.0;
  config.access.take_notice_s = 0.0;
  return config;
}

class Calibrating : public RunningService {
 public:
  Calibrating() : RunningService(uncalibrated()), stub(v1::CalibrationService::NewStub(channel)) {}

  grpc::Status start(const v1::StartCalibrationRequest& request) const {
    v1::StartCalibrationResponse response;
    return stub->StartCalibration(call_context().get(), request, &response);
  }
  grpc::Status push(const std::vector<v1::PushReferencePosesRequest>& pieces) const {
    const auto context = call_context();
    v1::PushReferencePosesResponse response;
    const auto writer = stub->PushReferencePoses(context.get(), &response);
    for (const auto& piece : pieces) {
      if (!writer->Write(piece)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }
  v1::CalibrationProgress finish() const {
    v1::CalibrationProgress progress;
    const auto status = stub->FinishCalibration(call_context(std::chrono::seconds(120)).get(), {}, &progress);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return progress;
  }

  std::unique_ptr<v1::CalibrationService::Stub> stub;
};

void set(v1::Vector3& message, const Eigen::Vector3d& v) {
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
}
void set(v1::Quaternion& message, const Eigen::Quaterniond& q) {
  message.set_w(q.w());
  message.set_x(q.x());
  message.set_y(q.y());
  message.set_z(q.z());
}

/// A trial as a client would push it.
std::vector<v1::PushReferencePosesRequest> pieces_of(const study::RegistrationTrial& trial) {
  std::vector<v1::PushReferencePosesRequest> pieces(1);
  for (const auto& pose : trial.rig.poses()) {
    if (pieces.back().rig_poses_size() == 400) pieces.emplace_back();
    v1::RecordedRigPose& message = *pieces.back().add_rig_poses();
    message.set_time_ns(std::llround(1e9 * pose.time_s));
    set(*message.mutable_tip_mm(), pose.tip_mm);
    set(*message.mutable_orientation(), pose.orientation);
    for (const double angle : pose.angles.joint_rad) message.add_joint_rad(angle);
    for (const double angle : pose.angles.gimbal_rad) message.add_gimbal_rad(angle);
  }
  for (const auto& pose : trial.reference) {
    if (pieces.back().poses_size() == 400) pieces.emplace_back();
    v1::ReferencePose& message = *pieces.back().add_poses();
    message.set_stamp_ns(std::llround(1e9 * pose.stamp_s));
    set(*message.mutable_position_mm(), pose.position_mm);
    if (pose.orientation) set(*message.mutable_orientation(), *pose.orientation);
  }
  return pieces;
}

v1::StartCalibrationRequest recorded(v1::CalibrationKind kind) {
  v1::StartCalibrationRequest request;
  request.set_kind(kind);
  request.set_recorded(true);
  return request;
}

TEST(ServiceCalibration, FindsStoresAndAdoptsFromPushedPoses) {
  const Calibrating service;
  const auto trial = study::record_trial({.seed = 21, .calibration_s = 40.0, .held_out_s = 1.0});
  ASSERT_TRUE(service.start(recorded(v1::CALIBRATION_KIND_KINEMATICS)).ok());
  const auto pushed = service.push(pieces_of(trial));
  ASSERT_TRUE(pushed.ok()) << pushed.error_message();
  const v1::CalibrationProgress progress = service.finish();
  ASSERT_EQ(progress.state(), v1::CALIBRATION_STATE_STORED) << progress.problem().what();

  v1::GetCalibrationRequest get;
  get.set_hash(progress.stored().substr(0, 10));
  const v1::Calibration found = answer_of(*service.stub, &v1::CalibrationService::Stub::GetCalibration, get);
  EXPECT_NEAR(found.latency_ms(), 1e3 * trial.latency_s, 0.5);
  EXPECT_LT(found.predicted_target_error_95_mm(), 1.0);
  EXPECT_GT(found.predicted_target_error_95_mm(), 0.0);
  EXPECT_GT(found.target_error_size(), 20);
  EXPECT_EQ(found.target_error(0).covariance_mm2_size(), 6);
  EXPECT_FALSE(found.adopted());

  const std::string on_corrected_poses = "name = \"on_corrected\"\ncorrected_poses = true\n";
  expect_refused_saying(service.load_toml(on_corrected_poses), grpc::StatusCode::FAILED_PRECONDITION,
                        "the scene works on corrected poses, and no calibration is adopted");

  v1::AdoptCalibrationRequest adopt;
  adopt.set_hash(progress.stored());
  answer_of(*service.stub, &v1::CalibrationService::Stub::AdoptCalibration, adopt);
  EXPECT_TRUE(service.load_toml(on_corrected_poses).ok());
  v1::ExplainSceneRequest explain;
  explain.set_toml(on_corrected_poses);
  const v1::SceneOutline outline = answer_of(*service.scene, &v1::SceneService::Stub::ExplainScene, explain);
  ASSERT_FALSE(outline.remarks().empty());
  EXPECT_EQ(outline.remarks(outline.remarks_size() - 1),
            "poses: corrected by calibration " + progress.stored().substr(0, 12));
  v1::DeleteCalibrationRequest remove;
  remove.set_hash(progress.stored());
  v1::DeleteCalibrationResponse removed;
  expect_refused_for(service.stub->DeleteCalibration(call_context().get(), remove, &removed),
                     grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_IN_USE);
  const v1::ListCalibrationsResponse all =
      answer_of(*service.stub, &v1::CalibrationService::Stub::ListCalibrations);
  ASSERT_EQ(all.calibrations_size(), 1);
  EXPECT_TRUE(all.calibrations(0).adopted());
}

TEST(ServiceCalibration, CalibratesTheSimulatedRigByItsTracker) {
  const Calibrating service;
  v1::StartCalibrationRequest request;
  request.set_kind(v1::CALIBRATION_KIND_REGISTRATION);
  request.set_simulated_tracker(true);
  ASSERT_TRUE(service.start(request).ok());
  const auto context = call_context(std::chrono::seconds(120));
  const auto stream = service.stub->WatchCalibration(context.get(), {});
  v1::CalibrationProgress progress;
  bool instructed = false;
  while (stream->Read(&progress)) instructed = instructed || !progress.instruction().empty();
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(instructed);
  EXPECT_EQ(progress.state(), v1::CALIBRATION_STATE_STORED) << progress.problem().what();
}

TEST(ServiceCalibration, RefusesWhatItCannotUse) {
  const Calibrating service;
  EXPECT_EQ(service.start({}).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::PushReferencePosesRequest piece;
  set(*piece.add_poses()->mutable_position_mm(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(service.push({piece}).error_code(), grpc::StatusCode::FAILED_PRECONDITION);

  ASSERT_TRUE(service.start(recorded(v1::CALIBRATION_KIND_KINEMATICS)).ok());
  EXPECT_EQ(service.start(recorded(v1::CALIBRATION_KIND_TIP)).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_TRUE(service.push({piece}).ok());
  piece.mutable_poses(0)->mutable_position_mm()->set_x(NAN);
  EXPECT_EQ(service.push({piece}).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  piece.mutable_poses(0)->clear_position_mm();
  EXPECT_EQ(service.push({piece}).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const v1::CalibrationProgress few = service.finish();
  EXPECT_EQ(few.state(), v1::CALIBRATION_STATE_FAILED);
  EXPECT_EQ(few.problem().what(), "too few poses");

  ASSERT_TRUE(service.start(recorded(v1::CALIBRATION_KIND_TIP)).ok());
  const v1::CalibrationProgress cancelled =
      answer_of(*service.stub, &v1::CalibrationService::Stub::CancelCalibration);
  EXPECT_EQ(cancelled.state(), v1::CALIBRATION_STATE_CANCELLED);
}

/// A calibration of one client whose lease another one takes.
class CalibratingUnderALease : public testing::Test {
 protected:
  /// Acquires the lease only now: to simulate what is pushed may take longer than a lease is kept.
  grpc::Status start(const v1::StartCalibrationRequest& request) {
    EXPECT_TRUE(holder_.acquire().ok());
    v1::StartCalibrationResponse response;
    return service_.stub->StartCalibration(holder_.context().get(), request, &response);
  }
  /// Takes the lease once the calibration is in this state, and returns the end of it.
  v1::CalibrationProgress end_when_taken_at(v1::CalibrationState state) {
    const auto context = call_context();
    const auto stream = service_.stub->WatchCalibration(context.get(), {});
    v1::CalibrationProgress progress;
    while (progress.state() != state && stream->Read(&progress)) {
    }
    EXPECT_TRUE(taker_.take().ok());
    stored_when_taken_ = stored();
    EXPECT_TRUE(ok(read_all(*stream, progress))) << "the calibration goes on";
    return progress;
  }
  int stored() const {
    const v1::ListCalibrationsResponse all =
        answer_of(*service_.stub, &v1::CalibrationService::Stub::ListCalibrations);
    return all.calibrations_size();
  }

  const Calibrating service_;
  AccessClient holder_{connect(service_.address())};
  AccessClient taker_{connect(service_.address())};
  int stored_when_taken_ = 0;
};

TEST_F(CalibratingUnderALease, EndsWithIt) {
  ASSERT_TRUE(ok(start(recorded(v1::CALIBRATION_KIND_KINEMATICS))));
  const v1::CalibrationProgress end = end_when_taken_at(v1::CALIBRATION_STATE_RECORDING);
  EXPECT_EQ(end.state(), v1::CALIBRATION_STATE_CANCELLED);
  EXPECT_NE(end.problem().what().find("was taken by"), std::string::npos) << end.ShortDebugString();
}

TEST_F(CalibratingUnderALease, IsNotAdoptedAfterIt) {
  const auto trial = study::record_trial({.seed = 21, .calibration_s = 40.0, .held_out_s = 1.0});
  v1::StartCalibrationRequest request = recorded(v1::CALIBRATION_KIND_KINEMATICS);
  request.set_adopt(true);
  ASSERT_TRUE(ok(start(request)));
  const auto context = holder_.context();
  v1::PushReferencePosesResponse pushed;
  const auto writer = service_.stub->PushReferencePoses(context.get(), &pushed);
  for (const auto& piece : pieces_of(trial)) ASSERT_TRUE(writer->Write(piece));
  writer->WritesDone();
  ASSERT_TRUE(ok(writer->Finish()));
  std::thread finishing([&] {
    v1::CalibrationProgress unused;
    (void)service_.stub->FinishCalibration(holder_.context().get(), {}, &unused);
  });
  const v1::CalibrationProgress end = end_when_taken_at(v1::CALIBRATION_STATE_FITTING);
  finishing.join();
  EXPECT_EQ(stored(), stored_when_taken_) << "after the take";
  if (stored_when_taken_ > 0) return;  // it was computed before the lease was taken
  EXPECT_EQ(end.state(), v1::CALIBRATION_STATE_CANCELLED);
  EXPECT_EQ(end.stored(), "");
}

TEST(ServiceCalibration, AStreamThatOutlivesTheCalibrationKeepsWhatItGave) {
  const Calibrating service;
  ASSERT_TRUE(service.start(recorded(v1::CALIBRATION_KIND_TIP)).ok());
  v1::PushReferencePosesRequest piece;
  set(*piece.add_poses()->mutable_position_mm(), Eigen::Vector3d(1, 2, 3));
  const auto context = call_context(std::chrono::seconds(30));
  v1::PushReferencePosesResponse response;
  const auto writer = service.stub->PushReferencePoses(context.get(), &response);
  ASSERT_TRUE(writer->Write(piece));
  const auto watching = call_context(std::chrono::seconds(30));
  const auto watch = service.stub->WatchCalibration(watching.get(), {});
  v1::CalibrationProgress progress;
  while (progress.reference_poses() == 0 && watch->Read(&progress)) {
  }
  ASSERT_EQ(progress.reference_poses(), 1u);
  answer_of(*service.stub, &v1::CalibrationService::Stub::CancelCalibration);
  writer->Write(piece);
  writer->WritesDone();
  const auto status = writer->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.poses(), 1u);
}

}  // namespace
}  // namespace hapticd::test
