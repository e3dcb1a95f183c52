#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(ServiceSimulation, TellsWhatIsThere) {
  const RunningService service;
  const v1::SimulationInfo info = answer_of(*service.simulation, &v1::SimulationService::Stub::GetSimulation);
  EXPECT_EQ(info.device(), "phantom_1_0");
  EXPECT_EQ(info.object(), "sponge_block");
  EXPECT_NEAR(info.object_stiffness_n_per_mm(), 0.38, 1e-9);
  EXPECT_NE(std::find(info.objects().begin(), info.objects().end(), "none"), info.objects().end());
}

TEST(ServiceSimulation, ExchangesTheObject) {
  const RunningService service;
  v1::SetObjectRequest request;
  request.set_name("rubber_ball");
  v1::SetObjectResponse response =
      answer_of(*service.simulation, &v1::SimulationService::Stub::SetObject, request);
  EXPECT_EQ(response.simulation().object(), "rubber_ball");
  request.set_name("ruber_ball");
  const grpc::Status status = service.simulation->SetObject(call_context().get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(status).remedy(), "did you mean 'rubber_ball'?");
}

TEST(ServiceSimulation, RefusesProgramsThatMakeNoSense) {
  const RunningService service;
  const auto set = [&](const std::function<void(v1::HandProgram&)>& change) {
    v1::SetHandProgramRequest request;
    change(*request.mutable_program());
    v1::SetHandProgramResponse response;
    return service.simulation->SetHandProgram(call_context().get(), request, &response);
  };
  using P = v1::HandProgram;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(detail_of(set([](P&) {})).where(), "SetHandProgramRequest.program.kind");
  const auto kind = [](P& p, v1::HandProgramKind of) -> P& {
    p.set_kind(of);
    return p;
  };
  for (const auto& wrong : std::vector<std::function<void(P&)>>{
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_PRESS).set_force_n(-1.0); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_PRESS).set_force_n(31.0); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_PRESS).set_force_n(kNaN); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_SHAKE).set_tilt_deg(90.0); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_SHAKE).mutable_shake_direction(); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_TAP).set_tap_slant_deg(-1.0); },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_TAP).mutable_place_mm()->set_x(250.0); }}) {
    expect_refused(set(wrong), grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_OUT_OF_RANGE,
                   "SetHandProgramRequest.program");
  }
  for (const auto& right : std::vector<std::function<void(P&)>>{
           [&](P& p) {
             kind(p, v1::HAND_PROGRAM_KIND_SHAKE).set_tilt_deg(20.0);
             p.mutable_shake_direction()->set_x(2.0);
           },
           [&](P& p) { kind(p, v1::HAND_PROGRAM_KIND_TAP).mutable_place_mm()->set_x(12.0); }}) {
    EXPECT_TRUE(set(right).ok());
  }
}

TEST(ServiceSimulation, ExistsOnlyOnASimulatedRig) {
  const TemporaryFolder folder;
  const RunningService service(config_that_replays(
      folder.write("run.csv", "time_s,force_N,position_mm\n0,0,0\n1,0,1\n2,1,2\n3,0,0\n")));
  const auto expect_not_simulated = [](const grpc::Status& status) {
    expect_refused(status, grpc::StatusCode::FAILED_PRECONDITION, "rig 'replay:run.csv'");
  };
  v1::SetHandProgramRequest program;
  program.mutable_program()->set_kind(v1::HAND_PROGRAM_KIND_TAP);
  v1::SetHandProgramResponse program_response;
  expect_not_simulated(service.simulation->SetHandProgram(call_context().get(), program, &program_response));
  v1::SimulationInfo info;
  expect_not_simulated(service.simulation->GetSimulation(call_context().get(), {}, &info));
  v1::SetObjectRequest object;
  object.set_name("sponge_block");
  v1::SetObjectResponse object_response;
  expect_not_simulated(service.simulation->SetObject(call_context().get(), object, &object_response));
}

}  // namespace
}  // namespace hapticd::test
