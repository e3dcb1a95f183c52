#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/integration/error_detail.h"
#include "tests/integration/identification/identifying.h"
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

server::DaemonConfig replay_config(const std::string& path) {
  server::DaemonConfig config = quiet_config();
  config.rig = server::RigChoice::kReplay;
  config.replay.path = path;
  return config;
}

TEST(ServiceRecordings, OneThatCannotBePlayedEndsTheStartAndIsNamed) {
  const TemporaryFolder folder;
  const std::string narrow = folder.write("narrow.csv", "time_s,force_N\n0,0\n1,1\n");
  server::DaemonConfig absent = replay_config("/nowhere/run.csv");
  server::DaemonConfig unmapped = replay_config(narrow);
  server::DaemonConfig mapped = replay_config(narrow);
  mapped.replay.position.column = "tip_um";
  const std::string whole = folder.write("run.csv", "time_s,force_N,position_mm\n0,0,0\n1,1,1\n");
  server::DaemonConfig wrong_unit = replay_config(whole);
  wrong_unit.replay.force = {.column = "force_N", .unit = "mm"};
  struct Case {
    const server::DaemonConfig& config;
    std::string where, words;
  };
  for (const Case& one : {Case{absent, "recording '/nowhere/run.csv'", "there is no such file"},
                          {unmapped, "recording '" + narrow + "'", "the file's columns are time_s, force_N"},
                          {mapped, "recording '" + narrow + "'", "'tip_um'"},
                          {wrong_unit, "recording '" + whole + "', column 'force_N'", "'mm'"}}) {
    server::StartFailure failure;
    EXPECT_EQ(server::Daemon::start(one.config, failure), nullptr);
    EXPECT_EQ(failure.code, server::ExitCode::kCannotOpenRig);
    EXPECT_EQ(failure.error.where, one.where);
    EXPECT_NE(failure.error.text().find(one.words), std::string::npos) << failure.error.text();
  }
}

TEST(ServiceRecordings, Hdf5IsNotTakenForIdentification) {
  const Identifying service(quiet_config());
  v1::UploadRecordingResponse uploaded;
  const grpc::Status status = service.upload("\x89HDF\r\n\x1a\n more\n and more\n", &uploaded);
  expect_refused_saying(status, grpc::StatusCode::INVALID_ARGUMENT, "this is an HDF5 file");
  EXPECT_NE(detail_of(status).remedy().find("hapticctl record get"), std::string::npos);
}

TEST(ServiceRecordings, ShowContactAndStiffnessFromTheFirstTick) {
  const TemporaryFolder folder;
  server::DaemonConfig config = replay_config(folder.write("run.csv", press_recording(0.5)));
  config.scene = "tap_1d";
  config.replay.loop = true;
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
  server::DaemonConfig config = replay_config(folder.write("run.csv", press_recording(0.5)));
  config.scene = "tap_1d";
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
  server::DaemonConfig config = replay_config(folder.write("run.csv", press_recording(0.5)));
  config.replay.loop = true;
  const RunningService service(config);
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_TRUTH);
  request.add_groups(v1::FIELD_GROUP_SAMPLE);
  grpc::ClientContext context;
  const auto reader = service.telemetry->Subscribe(&context, request);
  v1::TelemetryBatch batch;
  ASSERT_TRUE(reader->Read(&batch));
  EXPECT_FALSE(batch.samples(0).has_truth()) << "a group that does not exist is absent";
  EXPECT_TRUE(batch.samples(0).has_sample());
  context.TryCancel();
  reader->Finish();
}

}  // namespace
}  // namespace hapticd::test
