#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(ServiceSimulation, TellsWhatIsThere) {
  const RunningService service;
  v1::SimulationInfo info;
  ASSERT_TRUE(service.simulation->GetSimulation(call_context().get(), {}, &info).ok());
  EXPECT_EQ(info.device(), "phantom_1_0");
  EXPECT_EQ(info.object(), "sponge_block");
  EXPECT_NEAR(info.object_stiffness_n_per_mm(), 0.38, 1e-9);
  EXPECT_NE(std::find(info.objects().begin(), info.objects().end(), "none"), info.objects().end());
}

TEST(ServiceSimulation, ExchangesTheObject) {
  const RunningService service;
  v1::SetObjectRequest request;
  request.set_name("rubber_ball");
  v1::SetObjectResponse response;
  ASSERT_TRUE(service.simulation->SetObject(call_context().get(), request, &response).ok());
  EXPECT_EQ(response.simulation().object(), "rubber_ball");
  request.set_name("ruber_ball");
  const grpc::Status status = service.simulation->SetObject(call_context().get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(status).what(), "no such object");
  EXPECT_EQ(detail_of(status).remedy(), "did you mean 'rubber_ball'?");
}

TEST(ServiceSimulation, AHandPressesTheObject) {
  const RunningService service;
  ASSERT_TRUE(service.load("tap_1d").ok());
  const v1::RigState pressed =
      service.press(2.0, [](const v1::RigState& s) { return s.hand_force_n() > 1.0; });
  EXPECT_GT(pressed.displacement_mm(), 0.0);
}

TEST(ServiceSimulation, RefusesProgramsThatMakeNoSense) {
  const RunningService service;
  v1::SetHandProgramRequest request;
  v1::SetHandProgramResponse response;
  expect_refused(service.simulation->SetHandProgram(call_context().get(), request, &response),
                 grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID,
                 "SetHandProgramRequest.program.kind");
  request.mutable_program()->set_kind(v1::HAND_PROGRAM_KIND_PRESS);
  for (const double force_n : {-1.0, 31.0, std::numeric_limits<double>::quiet_NaN()}) {
    request.mutable_program()->set_force_n(force_n);
    const grpc::Status status = service.simulation->SetHandProgram(call_context().get(), request, &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << force_n;
    EXPECT_EQ(detail_of(status).what(), "force_n is out of range");
    EXPECT_EQ(detail_of(status).where(), "SetHandProgramRequest.program");
  }
}

TEST(ServiceSimulation, TheHandTiltsSlantsAndShakesAsAsked) {
  const RunningService service;
  v1::SetHandProgramResponse response;
  v1::SetHandProgramRequest request;
  v1::HandProgram& program = *request.mutable_program();
  program.set_kind(v1::HAND_PROGRAM_KIND_SHAKE);
  program.mutable_shake_direction()->set_x(2.0);
  program.set_tilt_deg(20.0);
  EXPECT_TRUE(service.simulation->SetHandProgram(call_context().get(), request, &response).ok());
  program.set_tilt_deg(90.0);
  grpc::Status status = service.simulation->SetHandProgram(call_context().get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(detail_of(status).what(), "tilt_deg is out of range");
  program.set_tilt_deg(0.0);
  program.mutable_shake_direction()->set_x(0.0);
  status = service.simulation->SetHandProgram(call_context().get(), request, &response);
  EXPECT_EQ(detail_of(status).what(), "shake_direction's length is out of range");
  program.set_kind(v1::HAND_PROGRAM_KIND_TAP);
  program.clear_shake_direction();
  program.set_tap_slant_deg(-1.0);
  status = service.simulation->SetHandProgram(call_context().get(), request, &response);
  EXPECT_EQ(detail_of(status).what(), "tap_slant_deg is out of range");
  program.clear_tap_slant_deg();
  program.mutable_place_mm()->set_x(12.0);
  EXPECT_TRUE(service.simulation->SetHandProgram(call_context().get(), request, &response).ok());
  program.mutable_place_mm()->set_x(250.0);
  status = service.simulation->SetHandProgram(call_context().get(), request, &response);
  EXPECT_EQ(detail_of(status).what(), "place_mm.x is out of range");
}

TEST(ServiceSimulation, ExistsOnlyOnASimulatedRig) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.rig = server::RigChoice::kReplay;
  config.replay.loop = true;
  config.replay.path = folder.write("run.csv", "time_s,force_N,position_mm\n0,0,0\n1,0,1\n2,1,2\n3,0,0\n");
  const RunningService service(config);
  const Expected expected{grpc::StatusCode::FAILED_PRECONDITION,
                          "the rig is not simulated",
                          "rig 'replay:run.csv'",
                          "",
                          "a simulated rig",
                          "start the daemon with --rig sim"};
  v1::SetHandProgramRequest program;
  program.mutable_program()->set_kind(v1::HAND_PROGRAM_KIND_TAP);
  v1::SetHandProgramResponse program_response;
  expect_refused(service.simulation->SetHandProgram(call_context().get(), program, &program_response),
                 expected);
  v1::SimulationInfo info;
  expect_refused(service.simulation->GetSimulation(call_context().get(), {}, &info), expected);
  v1::SetObjectRequest object;
  object.set_name("sponge_block");
  v1::SetObjectResponse object_response;
  expect_refused(service.simulation->SetObject(call_context().get(), object, &object_response), expected);
}

}  // namespace
}  // namespace hapticd::test
