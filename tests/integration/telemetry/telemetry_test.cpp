#include <gtest/gtest.h>
#include <signal.h>

#include <functional>
#include <optional>

#include "tests/integration/daemon_process.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

/// Reads a stream and keeps account of its sequence.
class Reader {
 public:
  Reader(const std::string& address, const v1::SubscribeRequest& request, Window window = Window::kGrowing)
      : stub_(v1::TelemetryService::NewStub(connect(address, window))),
        stream_(stub_->Subscribe(&context_, request)),
        decimation_(request.decimation() == 0 ? 1 : request.decimation()) {}
  ~Reader() {
    if (ended_) return;
    context_.TryCancel();
    stream_->Finish();
  }

  /// One batch; false at the end of the stream.
  bool read() {
    if (!stream_->Read(&batch_)) return false;
    for (const v1::TelemetrySample& sample : batch_.samples()) {
      if (last_tick_) missing_ += (sample.tick() - *last_tick_) / decimation_ - 1;
      last_tick_ = sample.tick();
      ++samples_;
    }
    return true;
  }
  const v1::TelemetryBatch& batch() const { return batch_; }
  std::uint64_t samples() const { return samples_; }
  std::uint64_t missing() const { return missing_; }
  std::uint64_t last_tick() const { return last_tick_.value_or(0); }
  grpc::Status end() {
    ended_ = true;
    return stream_->Finish();
  }

 private:
  std::unique_ptr<v1::TelemetryService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::TelemetryBatch>> stream_;
  v1::TelemetryBatch batch_;
  std::uint64_t decimation_;
  std::optional<std::uint64_t> last_tick_;
  std::uint64_t samples_ = 0;
  std::uint64_t missing_ = 0;
  bool ended_ = false;
};

TEST(ServiceTelemetry, CarriesEveryTickInOrder) {
  const RunningService service(config_with_scene("tap_1d"));
  Reader reader(service.address(), {});
  while (reader.samples() < 1000) ASSERT_TRUE(reader.read());
  EXPECT_EQ(reader.missing(), 0U);
  EXPECT_EQ(reader.batch().dropped_by_subscriber(), 0U);
  EXPECT_EQ(reader.batch().dropped_by_server(), 0U);
  const v1::TelemetrySample& sample = reader.batch().samples(0);
  EXPECT_TRUE(sample.has_sample() && sample.has_motion() && sample.has_contact() &&
              sample.has_deformation() && sample.has_target() && sample.has_control() && sample.has_guard() &&
              sample.has_timing() && sample.has_truth());
  EXPECT_FALSE(sample.has_direction() || sample.has_fusion() || sample.has_passivity())
      << "not in one dimension";
  EXPECT_EQ(sample.scene_generation(), 1U);
  EXPECT_EQ(sample.guard().state(), v1::GUARD_STATE_RENDERING);
  EXPECT_GT(sample.sample().force_count(), 0U);
  EXPECT_GE(sample.sample().force_age_ms(), 0.0);
  EXPECT_LT(sample.sample().force_age_ms(), 10.0);
  EXPECT_EQ(sample.sample().bias_serial(), 1U) << "a simulated sensor starts biased";
}

TEST(ServiceTelemetry, DecimatesAndCarriesOnlyWhatExists) {
  const RunningService service;  // no scene: nothing is known of contact or target
  v1::SubscribeRequest request;
  request.set_decimation(50);
  request.set_batch_size(4);
  request.add_groups(v1::FIELD_GROUP_CONTACT);
  request.add_groups(v1::FIELD_GROUP_GUARD);
  Reader reader(service.address(), request);
  while (reader.samples() < 12) {
    ASSERT_TRUE(reader.read());
    for (const v1::TelemetrySample& sample : reader.batch().samples()) {
      EXPECT_EQ(sample.tick() % 50, 0U);
      EXPECT_EQ(sample.scene_generation(), 0U);
      EXPECT_TRUE(sample.has_guard());
      EXPECT_FALSE(sample.has_contact());
      EXPECT_FALSE(sample.has_sample());
    }
  }
  EXPECT_EQ(reader.missing(), 0U);
}

TEST(ServiceTelemetry, RefusesWhatItDoesNotKnow) {
  const RunningService service;
  using Request = v1::SubscribeRequest;
  const auto refused = [&service](const std::function<void(Request&)>& change, grpc::StatusCode code,
                                  const std::string& field) {
    Request request;
    change(request);
    Reader reader(service.address(), request);
    EXPECT_FALSE(reader.read());
    expect_refused(reader.end(), code, "SubscribeRequest." + field);
  };
  using enum grpc::StatusCode;
  refused(
      [](Request& r) {
        r.add_groups(v1::FIELD_GROUP_SAMPLE);
        r.add_groups(static_cast<v1::FieldGroup>(42));
      },
      INVALID_ARGUMENT, "groups[1]");
  refused([](Request& r) { r.add_groups(v1::FIELD_GROUP_UNSPECIFIED); }, INVALID_ARGUMENT, "groups[0]");
  refused([](Request& r) { r.set_encoding(static_cast<v1::TelemetryEncoding>(9)); }, INVALID_ARGUMENT,
          "encoding");
  refused([](Request& r) { r.set_decimation(10001); }, OUT_OF_RANGE, "decimation");
  refused([](Request& r) { r.set_batch_size(1001); }, OUT_OF_RANGE, "batch_size");
  refused([](Request& r) { r.set_queue_samples(99); }, OUT_OF_RANGE, "queue_samples");
  service.await([](const v1::RigState& s) { return s.telemetry_subscribers() == 0; });
}

TEST(ServiceTelemetry, AStalledSubscriberLosesOnlyItsOwnAndIsReportedHowMany) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::SubscribeRequest small;
  small.set_queue_samples(100);
  small.set_batch_size(50);
  Reader stalled(service.address(), small, Window::kFixed);
  ASSERT_TRUE(stalled.read());
  const std::uint64_t dropped_before =
      stalled.batch().dropped_by_subscriber();  // before the first it received
  Reader reading(service.address(), {});

  // While the one does not read, the other goes on, until far more was sent than any buffer on the way holds.
  while (reading.samples() < 4000) ASSERT_TRUE(reading.read());
  EXPECT_EQ(reading.missing(), 0U);
  EXPECT_EQ(reading.batch().dropped_by_subscriber(), 0U);

  const std::uint64_t caught_up = reading.last_tick();
  while (stalled.last_tick() < caught_up) {
    ASSERT_TRUE(stalled.read());
    EXPECT_EQ(stalled.missing(), stalled.batch().dropped_by_subscriber() - dropped_before)
        << "every gap is counted, exactly";
    EXPECT_EQ(stalled.batch().dropped_by_server(), 0U);
  }
  EXPECT_GT(stalled.missing(), 0U);
  while (reading.samples() < 4500) ASSERT_TRUE(reading.read());
  EXPECT_EQ(reading.missing(), 0U);
}

TEST(ServiceTelemetry, AKilledSubscriberIsForgottenAndNoOneElseNotices) {
  const RunningService service(config_with_scene("tap_1d"));
  Reader reading(service.address(), {});
  ASSERT_TRUE(reading.read());
  ChildProcess killed(subscriber_binary(), {service.address()});
  ASSERT_FALSE(killed.read_line().empty());
  service.await([](const v1::RigState& s) { return s.telemetry_subscribers() == 2; });
  killed.signal(SIGKILL);
  EXPECT_EQ(killed.wait(), -SIGKILL);
  const std::uint64_t before = reading.samples();
  service.await([](const v1::RigState& s) { return s.telemetry_subscribers() == 1; });
  while (reading.samples() < before + 500) ASSERT_TRUE(reading.read());
  EXPECT_EQ(reading.missing(), 0U);
  EXPECT_EQ(reading.batch().dropped_by_subscriber(), 0U);
}

TEST(ServiceTelemetry, ManySubscribersComeAndGo) {
  const RunningService service(config_with_scene("tap_1d"));
  Reader constant(service.address(), {});
  for (int round = 0; round < 5; ++round) {
    std::vector<std::unique_ptr<Reader>> crowd;
    for (int i = 0; i < 8; ++i)
      crowd.push_back(std::make_unique<Reader>(service.address(), v1::SubscribeRequest{}));
    for (auto& reader : crowd) ASSERT_TRUE(reader->read());
    ASSERT_TRUE(constant.read());
  }
  service.await([](const v1::RigState& s) { return s.telemetry_subscribers() == 1; });
  const std::uint64_t now = service.state().tick();
  while (constant.last_tick() < now) ASSERT_TRUE(constant.read());
  EXPECT_EQ(constant.missing(), constant.batch().dropped_by_subscriber());
}

TEST(ServiceTelemetry, AStreamEndsWithTheService) {
  const RunningService service;
  Reader reader(service.address(), {});
  ASSERT_TRUE(reader.read());
  service.daemon->shutdown();
  while (reader.read()) {
  }
  EXPECT_EQ(reader.missing(), 0U);
  expect_refused(reader.end(), grpc::StatusCode::UNAVAILABLE, v1::ERROR_REASON_UNAVAILABLE, "telemetry");
}

TEST(ServiceTelemetry, ABatchOfADecimatedStreamWaitsForNoMoreThanTwentyTicks) {
  const RunningService service;
  for (const auto& [decimation, most] : {std::pair{1U, 20}, {4U, 5}, {16U, 1}, {100U, 1}}) {
    v1::SubscribeRequest request;
    request.set_decimation(decimation);
    Reader reader(service.address(), request);
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(reader.read());
      EXPECT_LE(reader.batch().samples_size(), most) << decimation;
    }
  }
}

}  // namespace
}  // namespace hapticd::test
