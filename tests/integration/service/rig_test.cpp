// What only concerns hardware, as a client meets it: the table of faults, the doctor, bias and homing, scenes
// that name a place of the turntable.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "hapticd/v1/turntable.grpc.pb.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

TEST(ServiceRig, TellsWhatEveryFaultDoes) {
  const RunningService service;
  const v1::ListFaultsResponse answer = answer_of(*service.safety, &v1::SafetyService::Stub::ListFaults);
  std::set<int> reported;
  for (const v1::FaultRule& rule : answer.faults()) {
    EXPECT_TRUE(reported.insert(rule.fault()).second);
    EXPECT_NE(rule.action(), v1::FAULT_ACTION_UNSPECIFIED);
    EXPECT_NE(rule.clearing(), v1::FAULT_CLEARING_UNSPECIFIED);
    EXPECT_FALSE(rule.cause().empty());
    EXPECT_FALSE(rule.remedy().empty());
  }
  EXPECT_EQ(static_cast<int>(reported.size()), v1::GuardFault_ARRAYSIZE - 2)
      << "all but UNSPECIFIED and NONE";
}

/// Findings of the doctor, only of this topic if there is one.
std::vector<v1::Finding> findings(const RunningService& service, const std::string& topic = {},
                                  bool probe = false) {
  v1::DiagnoseRequest request;
  request.set_probe(probe);
  std::vector<v1::Finding> found;
  const v1::Diagnosis diagnosis = answer_of(*service.rig, &v1::RigService::Stub::Diagnose, request);
  for (const v1::Finding& finding : diagnosis.findings()) {
    if (topic.empty() || finding.topic() == topic) found.push_back(finding);
  }
  return found;
}

TEST(ServiceRig, IsLookedOverByTheDoctor) {
  const RunningService service;
  std::set<std::string> topics;
  for (const v1::Finding& finding : findings(service, {}, true)) {
    topics.insert(finding.topic());
    EXPECT_FALSE(finding.text().empty());
    EXPECT_NE(finding.severity(), v1::FINDING_SEVERITY_UNSPECIFIED);
    EXPECT_NE(finding.severity(), v1::FINDING_SEVERITY_PROBLEM) << finding.text();
  }
  for (const char* topic : {"kernel", "CPU", "scheduling", "rights", "memory", "clock", "loop"}) {
    EXPECT_TRUE(topics.contains(topic)) << topic;
  }
}

TEST(ServiceRig, TheDoctorSaysThatTheGuardIsLatched) {
  const RunningService service;
  EXPECT_TRUE(findings(service, "guard").empty());
  answer_of(*service.safety, &v1::SafetyService::Stub::Stop);
  const auto found = findings(service, "guard");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].severity(), v1::FINDING_SEVERITY_WARNING);
  EXPECT_NE(found[0].text().find("latched, stopped"), std::string::npos) << found[0].text();
  EXPECT_NE(found[0].remedy().find("hapticctl clear"), std::string::npos) << found[0].remedy();
}

TEST(ServiceRig, ASimulatedOneIsBiasedAndHasNothingToHome) {
  const RunningService service(config_with_scene("tap_1d"));
  EXPECT_FALSE(service.state().has_sensor_bias());
  // Once the tool was seen free.
  v1::BiasForceSensorResponse biased;
  const v1::RigState state = service.await([&](const v1::RigState&) {
    return service.rig->BiasForceSensor(call_context().get(), {}, &biased).ok();
  });
  EXPECT_FALSE(biased.bias().id().empty());
  EXPECT_EQ(service.state().sensor_bias().id(), biased.bias().id());
  EXPECT_EQ(state.sensor_bias_lost(), "");
  v1::HomeDeviceResponse homed;
  expect_refused(service.rig->HomeDevice(call_context().get(), {}, &homed),
                 grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_WRONG_STATE, "haptic device");
}

TEST(ServiceRig, IsNeitherBiasedNorHomedInContact) {
  const RunningService service(config_with_scene("tap_1d"));
  service.press(2.0);
  v1::BiasForceSensorResponse biased;
  expect_refused_saying(service.rig->BiasForceSensor(call_context().get(), {}, &biased),
                        grpc::StatusCode::FAILED_PRECONDITION, "the tool is in contact: it cannot be biased");
}

TEST(ServiceRig, IsNotBiasedWhileAHandMovesTheTool) {
  const RunningService service;
  service.set_hand(v1::HAND_PROGRAM_KIND_TAP, [](v1::HandProgram& tap) { tap.set_repetitions(0); });
  v1::BiasForceSensorResponse biased;
  const grpc::Status status = service.rig->BiasForceSensor(call_context().get(), {}, &biased);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  const std::string what = detail_of(status).what();
  EXPECT_NE(what.find("while the bias was taken"), std::string::npos) << what;
  EXPECT_FALSE(service.state().has_sensor_bias());
}

// If no scene looks for contact, the last bias shows it.
TEST(ServiceRig, IsNotBiasedUnderALoadUnlessSomeoneHasLooked) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::BiasForceSensorRequest request;
  v1::BiasForceSensorResponse biased;
  const auto bias = [&] { return service.rig->BiasForceSensor(call_context().get(), request, &biased); };
  service.await([&](const v1::RigState&) { return bias().ok(); });
  service.press(2.0);
  answer_of(*service.scene, &v1::SceneService::Stub::UnloadScene);
  grpc::Status status;
  service.await([&](const v1::RigState&) {  // once the hand holds still
    status = bias();
    return detail_of(status).what().find("carries a load") != std::string::npos;
  });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_NE(detail_of(status).remedy().find("--tool-is-free"), std::string::npos);
  request.set_tool_is_free(true);
  EXPECT_TRUE(bias().ok());
}

TEST(ServiceRig, StateSaysContactZeroAndForce) {
  const RunningService service;
  v1::RigState state = service.await([](const v1::RigState& now) { return now.bias_serial() == 1; });
  EXPECT_EQ(state.contact_reason(), v1::CONTACT_REASON_UNSPECIFIED) << "no scene looks at contact";
  EXPECT_FALSE(state.has_followed_zero_n());
  EXPECT_EQ(state.zero_bound_n(), 0.0);

  ASSERT_TRUE(service.load("wall").ok());
  state = service.await(
      [](const v1::RigState& now) { return now.contact_reason() != v1::CONTACT_REASON_UNSPECIFIED; });
  EXPECT_EQ(state.zero_bound_n(), 0.0) << "a wall uses no sensor";

  ASSERT_TRUE(service.load("tap_1d").ok());
  state = service.press(
      2.0, [](const v1::RigState& now) { return now.in_contact() && now.contact_authority() >= 1.0; });
  EXPECT_TRUE(state.has_followed_zero_n());
  EXPECT_GT(state.zero_bound_n(), 0.0);
  EXPECT_GT(state.detection_force_n(), 0.0);
}

TEST(ServiceRig, TheDoctorLooksAtTheForceOfTheLoadedScene) {
  server::DaemonConfig config = quiet_config();
  config.simulation.object = "rubber_ball";  // the sensor bears most of the press
  const RunningService service(config);
  ASSERT_TRUE(service.load("tap_1d").ok());
  service.press(2.0,
                [](const v1::RigState& now) { return now.in_contact() && now.reaction_force_n() > 1.0; });
  const auto all = findings(service);
  const auto found = std::find_if(all.begin(), all.end(), [](const v1::Finding& finding) {
    return finding.text().find("its force follows the press axis") != std::string::npos;
  });
  ASSERT_NE(found, all.end());
  EXPECT_EQ(found->severity(), v1::FINDING_SEVERITY_GOOD);
}

constexpr const char* kAtStation = "name = \"there\"\nkind = \"tap_1d\"\nturntable_station = \"rubber\"\n";

v1::PartState table_of(const RunningService& service) {
  const v1::RigState state = service.state();
  const auto table = std::find_if(state.parts().begin(), state.parts().end(),
                                  [](const v1::PartReport& part) { return part.part() == "turntable"; });
  return table == state.parts().end() ? v1::PART_STATE_UNSPECIFIED : table->state();
}

TEST(ServiceRig, ASceneAtAStationNeedsATurntable) {
  const RunningService service;
  expect_refused_saying(service.load_toml(kAtStation), grpc::StatusCode::FAILED_PRECONDITION,
                        "a station is needed, and this rig has no turntable");
}

TEST(ServiceRig, ASceneIsLoadedWhereTheTableStandsAndOpensItOnlyIfItMust) {
  server::DaemonConfig config =
      config_with_table({{"sponge", 0.0, "sponge_block"}, {"rubber", 40.0, "rubber_ball"}});
  config.turntable.sim.homed = true;
  const RunningService service(config);
  ASSERT_TRUE(service.load("tap_1d").ok());
  EXPECT_EQ(table_of(service), v1::PART_STATE_IDLE) << "no one needs it";

  const grpc::Status elsewhere = service.load_toml(kAtStation);
  EXPECT_EQ(elsewhere.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << elsewhere.error_message();
  EXPECT_EQ(service.state().scene(), "tap_1d") << "nothing changed";

  const auto turntable = v1::TurntableService::NewStub(service.channel);
  const auto move_to = [&turntable](const char* station) {
    v1::MoveToRequest request;
    request.set_station(station);
    const auto context = call_context();
    v1::TurntableStatus last;
    return read_all(*turntable->MoveTo(context.get(), request), last);
  };
  ASSERT_TRUE(ok(move_to("rubber")));
  EXPECT_TRUE(ok(service.load_toml(kAtStation)));
  EXPECT_EQ(table_of(service), v1::PART_STATE_READY);

  expect_refused_saying(move_to("sponge"), grpc::StatusCode::FAILED_PRECONDITION,
                        "the loaded scene needs the table where it is");
}

TEST(ServiceRigState, IsSmallWithoutItsHistograms) {
  const RunningService service;
  service.await([](const v1::RigState& s) { return s.loop().wakeup().buckets_size() > 0; });
  v1::GetRigStateRequest request;
  request.set_without_histograms(true);
  const v1::RigState state = answer_of(*service.rig, &v1::RigService::Stub::GetRigState, request);
  EXPECT_EQ(state.loop().wakeup().buckets_size(), 0);
  EXPECT_GT(state.loop().wakeup().count(), 0U);
  EXPECT_LT(state.ByteSizeLong(), 2000U);
}

}  // namespace
}  // namespace hapticd::test
