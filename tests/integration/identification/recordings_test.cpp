#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

/// Half a second of approach, then a press of `stiffness` to 4 mm and back, at 1 kHz.
std::string press_recording(double stiffness_n_per_mm) {
  std::ostringstream text;
  text << "time_s,force_N,position_mm\n";
  for (int i = 0; i <= 3000; ++i) {
    const double time_s = i * 1e-3;
    const double depth_mm = 4.0 * std::sin((time_s - 0.5) / 2.5 * 3.14159265358979);
    text << time_s << "," << std::max(0.0, stiffness_n_per_mm * depth_mm) << "," << depth_mm << "\n";
  }
  return text.str();
}

TEST(ServiceRecordings, ShowContactAndStiffnessFromTheFirstTick) {
  const TemporaryFolder folder;
  server::DaemonConfig config = config_that_replays(folder.write("run.csv", press_recording(0.5)));
  config.scene = "tap_1d";
  const RunningService service(config);
  const v1::RigInfo info = answer_of(*service.rig, &v1::RigService::Stub::GetRigInfo);
  EXPECT_EQ(info.kind(), v1::RIG_KIND_REPLAY);
  EXPECT_FALSE(info.renders_force());
  const v1::RigState state = service.await([](const v1::RigState& s) { return s.reaction_force_n() > 1.0; });
  EXPECT_TRUE(state.in_contact());
  EXPECT_NEAR(state.reaction_force_n() / state.displacement_mm(), 0.5, 0.05);
}

TEST(ServiceRecordings, AnEndedOneIsReportedAndTakesNoCommands) {
  const TemporaryFolder folder;
  server::DaemonConfig config = config_that_replays(folder.write("run.csv", press_recording(0.5)));
  config.scene = "tap_1d";
  config.replay.loop = false;
  config.replay.as_fast_as_possible = true;
  const RunningService service(config);
  const v1::RigState state =
      service.await([](const v1::RigState& s) { return s.rig_exhausted() && s.tick() >= 3000; });
  EXPECT_FALSE(state.loop().running());
  EXPECT_EQ(state.tick(), 3000U);
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(1.0);
  expect_refused(service.set_target(request), grpc::StatusCode::FAILED_PRECONDITION,
                 v1::ERROR_REASON_RECORDING_ENDED, "rig 'replay:run.csv'");
}

TEST(ServiceRecordings, HaveNoTruth) {
  const TemporaryFolder folder;
  const RunningService service(config_that_replays(folder.write("run.csv", press_recording(0.5))));
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_TRUTH);
  request.add_groups(v1::FIELD_GROUP_SAMPLE);
  service.watch(request, [](const v1::TelemetrySample& sample) {
    EXPECT_FALSE(sample.has_truth()) << "a group that does not exist is absent";
    EXPECT_TRUE(sample.has_sample());
    return false;
  });
}

}  // namespace
}  // namespace hapticd::test
