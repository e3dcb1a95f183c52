#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <thread>
#include <vector>

#include "rt/signal/tick_interval.h"
#include "server/grpc/calls/target_log.h"
#include "tests/integration/command_record.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

v1::SetTargetRequest target(double stiffness_n_per_mm) {
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(stiffness_n_per_mm);
  return request;
}

TEST(ServiceTargets, NeedASceneAndAreFiniteAndInRange) {
  const RunningService service;
  expect_refused(service.set_target(target(0.5)), grpc::StatusCode::FAILED_PRECONDITION,
                 v1::ERROR_REASON_NO_SCENE, "scene");
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(service.load("tap_1d", &loaded).ok());
  const v1::SetTargetRequest good = target(0.7);
  struct Case {
    std::string field;
    double value;
    bool finite = true;
  };
  using Limits = std::numeric_limits<std::int64_t>;
  for (const Case& c :
       {Case{"stiffness_n_per_mm", std::nan(""), false}, Case{"stiffness_n_per_mm", HUGE_VAL, false},
        Case{"stiffness_n_per_mm", -0.1}, Case{"stiffness_n_per_mm", 1000.1}, Case{"ramp_s", 61.0}}) {
    v1::SetTargetRequest request = good;
    c.field == "ramp_s" ? request.set_ramp_s(c.value) : request.set_stiffness_n_per_mm(c.value);
    expect_refused(service.set_target(request),
                   c.finite ? grpc::StatusCode::OUT_OF_RANGE : grpc::StatusCode::INVALID_ARGUMENT,
                   c.finite ? v1::ERROR_REASON_OUT_OF_RANGE : v1::ERROR_REASON_INVALID,
                   "SetTargetRequest." + c.field);
  }
  for (const std::int64_t time_ns : {Limits::max(), std::int64_t{1}, std::int64_t{-1}, Limits::min()}) {
    v1::SetTargetRequest request = good;
    request.set_at_time_ns(time_ns);
    expect_refused_saying(service.set_target(request), grpc::StatusCode::OUT_OF_RANGE,
                          time_ns == Limits::max() ? "the time lies too far ahead" : "the time has passed");
  }
  expect_refused(service.set_target({}), grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID,
                 "SetTargetRequest");
  const v1::RigState state =
      service.await([&](const v1::RigState& s) { return s.tick() >= loaded.effective_tick(); });
  EXPECT_EQ(state.target_stiffness_n_per_mm(), 0.5) << "nothing of all this reached the loop";
}

TEST(ServiceTargets, AreGrantedUpToWhatTheSceneTheDeviceAndTheStructureBear) {
  const std::string soft = "name = \"soft\"\nkind = \"explore\"\nobject_model = \"sponge_cut\"\n";
  const std::string stiff = "name = \"stiff\"\nkind = \"explore\"\nobject_model = \"foam_ball_3d\"\n";
  const auto at_most = [](const char* n_per_mm) {
    return std::string("[target]\nmax_stiffness_n_per_mm = ") + n_per_mm + "\n";
  };
  struct Case {
    const char* description;
    server::DaemonConfig config;
    std::string scene;
    double requested;
    double granted;
    v1::LimitingReason reason = v1::LIMITING_REASON_SCENE_MAXIMUM;
  };
  for (const Case& c : {
           Case{"what stays stable on the device", quiet_config(), "name = \"tap\"\n", 50.0, 1.0},
           Case{"a firm object", quiet_config(), stiff, 50.0, 1.0},
           Case{"four times a soft object's stiffness at 4 N (D§4.5)", generous_config(), soft, 50.0,
                4.0 * 0.18},
           Case{"a scene may say more", generous_config(), soft + at_most("2"), 50.0, 2.0},
           Case{"beyond the structure, which a scene that explores needs not", generous_config(),
                stiff + at_most("15"), 12.0, 12.0, v1::LIMITING_REASON_NONE},
           Case{"the scene's maximum there", generous_config(), stiff + at_most("15"), 20.0, 15.0},
           Case{"a gentle scene", quiet_config(), "name = \"gentle\"\n" + at_most("0.75"), 2.0, 0.75},
           Case{"less than that", quiet_config(), "name = \"gentle\"\n" + at_most("0.75"), 0.25, 0.25,
                v1::LIMITING_REASON_NONE},
       }) {
    SCOPED_TRACE(c.description);
    const RunningService service(c.config);
    ASSERT_TRUE(ok(service.load_toml(c.scene)));
    v1::SetTargetResponse response;
    ASSERT_TRUE(ok(service.set_target(target(c.requested), &response)));
    EXPECT_EQ(response.requested_n_per_mm(), c.requested);
    EXPECT_NEAR(response.granted_n_per_mm(), c.granted, c.scene == soft ? 0.1 : 1e-12);
    EXPECT_EQ(response.limiting_reason(), c.reason);
    EXPECT_EQ(response.explanation().empty(), c.reason == v1::LIMITING_REASON_NONE);
  }
}

TEST(ServiceTargets, AreReportedWhereTheyAreSofterThanTheDeviceCanMakeTheObject) {
  const RunningService service;
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.load_toml("name = \"soft\"\nkind = \"explore\"\nobject_model = \"sponge_cut\"\n").ok());
  ASSERT_TRUE(service.set_target(target(0.05), &response).ok());
  EXPECT_EQ(response.granted_n_per_mm(), 0.05) << "pressed less firmly it is feasible";
  EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_DEVICE_FORCE);
  EXPECT_EQ(
      response.explanation(),
      "0.05 N/mm granted; pressed with 4 N 'sponge_cut' feels no softer than 0.121 N/mm, for the device "
      "pulls with no more than 8.5 N (3.8)");
  for (const double dissertation_n_per_mm : {0.3, 0.5}) {
    ASSERT_TRUE(service.set_target(target(dissertation_n_per_mm), &response).ok());
    EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_NONE);
    EXPECT_EQ(response.explanation(), "");
  }
}

TEST(ServiceTargets, AStrongDeviceIsHeldByTheSensorsRange) {
  server::DaemonConfig config = quiet_config();
  config.simulation.device = "phantom_1_5_high_force";
  const RunningService service(config);
  v1::GetFeasibleRangeRequest request;
  request.set_hand_force_n(4.0);
  request.set_object_stiffness_n_per_mm(1.0);
  const v1::FeasibleRange range =
      answer_of(*service.rendering, &v1::RenderingService::Stub::GetFeasibleRange, request);
  EXPECT_NEAR(range.min_n_per_mm(), 4.0 / (4.0 + 0.7 * 35.0), 1e-12);
  EXPECT_EQ(range.device_max_force_n(), 37.5);
  ASSERT_TRUE(service.load_toml("name = \"soft\"\nkind = \"explore\"\nobject_model = \"sponge_cut\"\n").ok());
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.set_target(target(0.05), &response).ok());
  EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_DEVICE_FORCE);
  EXPECT_NE(response.explanation().find("24.5 N, 0.7 of the sensor's range"), std::string::npos)
      << response.explanation();
}

TEST(ServiceTargets, AreGrantedUpToTheCompensableStructuralStiffness) {
  const RunningService service(generous_config());
  ASSERT_TRUE(service.load_toml("name = \"hard\"\n[target]\nmax_stiffness_n_per_mm = 20\n").ok());
  const v1::RigInfo info = answer_of(*service.rig, &v1::RigService::Stub::GetRigInfo);
  const double limit = 0.8 * info.device().structural_stiffness_n_per_mm();
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.set_target(target(limit + 1.0), &response).ok());
  EXPECT_EQ(response.requested_n_per_mm(), limit + 1.0);
  EXPECT_DOUBLE_EQ(response.granted_n_per_mm(), limit);
  EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_STRUCTURAL_STIFFNESS);
  EXPECT_FALSE(response.explanation().empty());
}

v1::SetTargetRequest power_law(double stiffness, double damping, double exponent) {
  v1::SetTargetRequest request;
  v1::HuntCrossleyLaw& law = *request.mutable_law()->mutable_hunt_crossley();
  law.set_stiffness_n_per_mm_m(stiffness);
  law.set_damping_n_s_per_mm_m1(damping);
  law.set_exponent(exponent);
  return request;
}

void add_knot(v1::StiffnessProfile& profile, double at_mm, double stiffness_n_per_mm) {
  v1::StiffnessProfile::Knot& knot = *profile.add_knots();
  knot.set_at_mm(at_mm);
  knot.set_stiffness_n_per_mm(stiffness_n_per_mm);
}

TEST(ServiceTargets, OtherLawsAreGrantedWholeAndReported) {
  const RunningService service;
  EXPECT_FALSE(service.state().has_target_law()) << "no scene is loaded";
  ASSERT_TRUE(service.load("explore_rod").ok());
  EXPECT_EQ(service.state().target_law().linear_n_per_mm(), 0.5) << "the scene's own";
  ASSERT_TRUE(service.set_target(target(50.0)).ok());
  EXPECT_EQ(service.state().target_law().linear_n_per_mm(), 1.0) << "as much as was granted";

  v1::SetTargetRequest deep;
  add_knot(*deep.mutable_law()->mutable_displacement_profile(), 0.0, 0.2);
  add_knot(*deep.mutable_law()->mutable_displacement_profile(), 5.0, 0.8);
  v1::SetTargetRequest along;
  v1::StiffnessProfile& profile = *along.mutable_law()->mutable_position_profile();
  add_knot(profile, -20.0, 0.3);
  add_knot(profile, 20.0, 1.0);
  profile.mutable_axis()->set_y(3.0);
  v1::SetTargetRequest linear;
  linear.mutable_law()->set_linear_n_per_mm(0.4);
  for (const auto& [request, n_per_mm] :
       {std::pair(power_law(0.05, 0.001, 1.0), 0.05), {deep, 0.8}, {along, 1.0}, {linear, 0.4}}) {
    v1::SetTargetResponse response;
    ASSERT_TRUE(ok(service.set_target(request, &response)));
    EXPECT_DOUBLE_EQ(response.requested_n_per_mm(), n_per_mm);
    EXPECT_DOUBLE_EQ(response.granted_n_per_mm(), n_per_mm);
    EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_NONE);
    EXPECT_GT(response.effective_tick(), 0U);
    v1::TargetLaw expected = request.law();
    if (expected.has_position_profile()) expected.mutable_position_profile()->mutable_axis()->set_y(1.0);
    EXPECT_EQ(service.state().target_law().SerializeAsString(), expected.SerializeAsString());
  }
  ASSERT_TRUE(service.load("explore_tumour").ok());
  EXPECT_FALSE(service.state().has_target_law()) << "the object stays as it is";
}

TEST(ServiceTargets, AreSmallerWhereTheStructureSwingsSlowlyAndSaySo) {
  server::DaemonConfig config = quiet_config();
  config.simulation.structural_mode_hz = 75.0;
  const RunningService service(config);
  for (const std::string scene : {"tap_1d", "explore_bearing"}) {
    ASSERT_TRUE(service.load(scene).ok());
    v1::SetTargetResponse response;
    ASSERT_TRUE(ok(service.set_target(target(1.0), &response)));
    EXPECT_EQ(response.granted_n_per_mm(), 0.7);
    EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_SCENE_MAXIMUM);
    EXPECT_NE(response.explanation().find("swings at 75 Hz, less than 90 Hz"), std::string::npos)
        << response.explanation();
  }
  ASSERT_TRUE(service.load("wall").ok());
  v1::SetTargetResponse response;
  ASSERT_TRUE(ok(service.set_target(target(1.0), &response)));
  EXPECT_EQ(response.granted_n_per_mm(), 1.0) << "nothing real is modulated";
}

TEST(ServiceTargets, OtherLawsAreRefusedWhereARealObjectIsTapped) {
  const RunningService service;
  ASSERT_TRUE(service.load("wall").ok());
  EXPECT_TRUE(service.set_target(power_law(0.05, 0.001, 1.6)).ok()) << "a virtual object has any law";
  ASSERT_TRUE(service.load("tap_1d").ok());
  expect_refused(service.set_target(power_law(0.05, 0.001, 1.6)), grpc::StatusCode::FAILED_PRECONDITION,
                 v1::ERROR_REASON_NOT_IN_THIS_SCENE, "SetTargetRequest.law");
  v1::SetTargetRequest linear;
  linear.mutable_law()->set_linear_n_per_mm(0.4);
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.set_target(linear, &response).ok()) << "a linear law is a stiffness";
  EXPECT_EQ(response.granted_n_per_mm(), 0.4);
  ASSERT_TRUE(service.load("explore_tumour").ok());
  expect_refused(service.set_target(target(0.8)), grpc::StatusCode::FAILED_PRECONDITION,
                 v1::ERROR_REASON_NOT_IN_THIS_SCENE, "SetTargetRequest.law");
}

TEST(ServiceTargets, ALawThatIsNoneOrTooStiffIsRefusedWhole) {
  const RunningService service(config_with_scene("explore_rod"));
  v1::SetTargetRequest both = power_law(0.05, 0.001, 1.6);
  both.set_stiffness_n_per_mm(0.0);
  v1::SetTargetRequest none;
  none.mutable_law();
  v1::SetTargetRequest falling;
  add_knot(*falling.mutable_law()->mutable_displacement_profile(), 5.0, 0.2);
  add_knot(*falling.mutable_law()->mutable_displacement_profile(), 0.0, 0.8);
  v1::SetTargetRequest empty;
  empty.mutable_law()->mutable_position_profile();
  v1::SetTargetRequest many;
  for (int i = 0; i < 17; ++i) add_knot(*many.mutable_law()->mutable_position_profile(), i, 0.5);
  v1::SetTargetRequest turned;
  add_knot(*turned.mutable_law()->mutable_displacement_profile(), 0.0, 0.2);
  turned.mutable_law()->mutable_displacement_profile()->mutable_axis()->set_x(1.0);
  for (const auto& request : {both, none, turned, power_law(std::nan(""), 0.0, 1.0)}) {
    expect_refused(service.set_target(request), grpc::StatusCode::INVALID_ARGUMENT, "SetTargetRequest.law");
  }
  for (const auto& request : {power_law(0.05, 0.001, 4.0), power_law(6.0, 0.0, 1.0), falling, empty, many}) {
    expect_refused(service.set_target(request), grpc::StatusCode::OUT_OF_RANGE, v1::ERROR_REASON_OUT_OF_RANGE,
                   "SetTargetRequest.law");
  }
  EXPECT_DOUBLE_EQ(service.await([](const v1::RigState& s) { return s.target_stiffness_n_per_mm() > 0.0; })
                       .target_stiffness_n_per_mm(),
                   0.5)
      << "nothing of all this reached the loop";
}

TEST(ServiceTargets, TakeEffectAtTheTickOfTheAcknowledgementAndRamp) {
  const RunningService service;
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(service.load("tap_1d", &loaded).ok());
  CommandRecord record(service.channel);
  v1::SetTargetRequest request = target(1.0);
  request.set_ramp_s(0.2);
  v1::SetTargetResponse response;
  ASSERT_TRUE(ok(service.set_target(request, &response)));
  const std::uint64_t start = response.effective_tick();
  record.await_tick(start + 210);
  const auto ticks = record.stop();
  ASSERT_TRUE(ticks.contains(start));
  EXPECT_EQ(ticks.at(start).time_ns, response.effective_time_ns());
  // The ramp goes by measured time, from the last tick before it; a tick that comes too late to follow the
  // motion advances it by one period.
  double ramped_s = 0.0;
  for (auto at = ticks.lower_bound(loaded.effective_tick()); at != ticks.end(); ++at) {
    if (at->first >= start) {
      ASSERT_EQ(std::prev(at)->first, at->first - 1) << "telemetry has a gap";
      const double interval_s =
          static_cast<double>(at->second.time_ns - std::prev(at)->second.time_ns) * 1e-9;
      ramped_s += interval_s > rt::TickInterval::kMaxFollowedS ? 1e-3 : interval_s;
    }
    const bool ramps = at->first >= start && ramped_s <= 0.2;
    EXPECT_NEAR(at->second.target_n_per_mm, 0.5 + 0.5 * std::min(ramped_s / 0.2, 1.0), ramps ? 1e-6 : 1e-15)
        << at->first;
  }
}

TEST(ServiceTargets, HaveARampNoShorterThanTheDaemonAllowsAndSaySo) {
  server::DaemonConfig config = quiet_config();
  config.guard.min_target_ramp_s = 0.2;
  const RunningService service(config);
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(service.load("wall", &loaded).ok());
  CommandRecord record(service.channel);
  v1::SetTargetRequest request = target(1.0);
  request.set_ramp_s(0.0);
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.set_target(request, &response).ok());
  EXPECT_EQ(response.ramp_s(), 0.2);
  EXPECT_EQ(response.limiting_reason(), v1::LIMITING_REASON_NONE);
  EXPECT_EQ(response.explanation(),
            "the ramp of 0 s was lengthened to 0.2 s: [guard] min_target_ramp_s = 0.2 s");
  record.await_tick(response.effective_tick() + 210);
  const auto ticks = record.stop();
  double before = 0.5;
  for (auto at = ticks.lower_bound(loaded.effective_tick()); at != ticks.end(); ++at) {
    EXPECT_LE(at->second.target_n_per_mm - before, 0.5 / 200.0 + 1e-9) << at->first;
    before = at->second.target_n_per_mm;
  }
  EXPECT_DOUBLE_EQ(before, 1.0);
  request.set_ramp_s(0.3);
  ASSERT_TRUE(service.set_target(request, &response).ok());
  EXPECT_EQ(response.ramp_s(), 0.3);
  EXPECT_EQ(response.explanation(), "");
}

// The damping of the law that is replaced counts as well, also if the scene itself has none.
TEST(ServiceTargets, HaveARampForTheDampingOfTheLawInForce) {
  server::DaemonConfig config = generous_config();
  config.guard.max_target_change_n_per_s = 5.0;
  const RunningService service(config);
  ASSERT_TRUE(service.load("explore_rod").ok());
  v1::SetTargetRequest damped;
  auto& law = *damped.mutable_law()->mutable_hunt_crossley();
  law.set_stiffness_n_per_mm_m(0.3);
  law.set_damping_n_s_per_mm_m1(0.005);
  law.set_exponent(1.0);
  ASSERT_TRUE(ok(service.set_target(damped)));
  service.press(1.0, [](const v1::RigState& s) { return s.in_contact() && s.displacement_mm() > 1.0; });
  v1::SetTargetRequest linear = target(0.3);
  linear.set_ramp_s(0.0);
  v1::SetTargetResponse response;
  ASSERT_TRUE(service.set_target(linear, &response).ok());
  EXPECT_GE(response.ramp_s(), 0.005 * 100.0 / 5.0) << response.explanation();
}

TEST(ServiceTargets, WaitForTheTimeAskedFor) {
  const RunningService service(generous_config());
  ASSERT_TRUE(service.load("tap_1d").ok());
  // A target is handed to the loop 0.1 s ahead. On a machine that pauses for longer it comes late, and says
  // so: that must not happen again and again.
  bool in_time = false;
  double stiffness_before = 0.5;
  for (int attempt = 0; attempt < 5 && !in_time; ++attempt) {
    const double stiffness = 0.875 - 0.125 * attempt;
    CommandRecord record(service.channel);
    v1::SetTargetRequest request = target(stiffness);
    request.set_ramp_s(0.0);
    request.set_at_time_ns(service.state().time_ns() + 1'500'000'000);
    v1::SetTargetResponse response;
    ASSERT_TRUE(ok(service.set_target(request, &response)));
    EXPECT_GE(response.effective_time_ns(), request.at_time_ns());
    record.await_tick(response.effective_tick() + 5);
    const auto ticks = record.stop();
    const auto effect = ticks.find(response.effective_tick());
    ASSERT_NE(effect, ticks.end());
    EXPECT_EQ(effect->second.time_ns, response.effective_time_ns());
    for (const auto& [tick, seen] : ticks) {
      EXPECT_DOUBLE_EQ(seen.target_n_per_mm, tick < effect->first ? stiffness_before : stiffness) << tick;
    }
    const std::int64_t last_before_ns = std::prev(effect)->second.time_ns;
    in_time = last_before_ns < request.at_time_ns();  // the first tick whose time had come
    stiffness_before = stiffness;
  }
  EXPECT_TRUE(in_time);
}

TEST(ServiceTargets, ADeadlineWithdrawsAWaitingTarget) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::SetTargetRequest request = target(1.25);
  request.set_ramp_s(0.0);
  request.set_at_time_ns(service.state().time_ns() + 3'000'000'000);
  v1::SetTargetResponse response;
  const grpc::Status status =
      service.rendering->SetTarget(call_context(std::chrono::milliseconds(200)).get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  const v1::RigState later =
      service.await([&](const v1::RigState& s) { return s.time_ns() > request.at_time_ns() + 50'000'000; });
  EXPECT_DOUBLE_EQ(later.target_stiffness_n_per_mm(), 0.5);
}

TEST(ServiceTargets, AnotherSceneWithdrawsAWaitingTarget) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::SetTargetRequest request = target(1.25);
  request.set_at_time_ns(service.state().time_ns() + 1'500'000'000);
  grpc::Status status;
  std::thread waiting([&] { status = service.set_target(request); });
  // Whichever of the two arrives first, the target must not reach the other scene.
  ASSERT_TRUE(service.load("wall").ok());
  waiting.join();
  if (!status.ok()) {
    expect_refused(status, grpc::StatusCode::ABORTED, v1::ERROR_REASON_STATE_CHANGED, "scene");
    EXPECT_DOUBLE_EQ(service.state().target_stiffness_n_per_mm(), 0.5);
  }
}

TEST(ServiceTargets, OnlySoManyWaitAndOthersStillPass) {
  const RunningService service(config_with_scene("tap_1d"));
  v1::SetTargetRequest request = target(1.25);
  request.set_at_time_ns(service.state().time_ns() + 50'000'000'000);
  constexpr int kCalls = 24;
  grpc::CompletionQueue queue;
  std::array<grpc::ClientContext, kCalls> contexts;
  std::array<grpc::Status, kCalls> statuses;
  std::array<v1::SetTargetResponse, kCalls> responses;
  std::vector<std::unique_ptr<grpc::ClientAsyncResponseReader<v1::SetTargetResponse>>> calls;
  for (std::size_t i = 0; i < kCalls; ++i) {
    calls.push_back(service.rendering->AsyncSetTarget(&contexts[i], request, &queue));
    calls.back()->Finish(&responses[i], &statuses[i], reinterpret_cast<void*>(i));
  }
  // The eight that are too many come back at once; sixteen wait.
  for (int refused = 0; refused < kCalls - 16; ++refused) {
    void* tag = nullptr;
    bool ok = false;
    ASSERT_TRUE(queue.Next(&tag, &ok));
    const grpc::Status& status = statuses[reinterpret_cast<std::size_t>(tag)];
    expect_refused_saying(status, grpc::StatusCode::RESOURCE_EXHAUSTED,
                          "too many targets wait for their time");
  }
  // They hold up no other client.
  EXPECT_TRUE(service.set_target(target(0.75)).ok());
  EXPECT_TRUE(service.stop().ok());
  EXPECT_TRUE(service.clear().ok());
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (int waiting = 0; waiting < 16; ++waiting) {
    void* tag = nullptr;
    bool ok = false;
    ASSERT_TRUE(queue.Next(&tag, &ok));
    EXPECT_EQ(statuses[reinterpret_cast<std::size_t>(tag)].error_code(), grpc::StatusCode::CANCELLED);
  }
  queue.Shutdown();
}

TEST(ServiceTargets, ShuttingDownLetsWaitingCallsGo) {
  RunningService service;
  ASSERT_TRUE(service.load("tap_1d").ok());
  v1::SetTargetRequest request = target(1.25);
  request.set_at_time_ns(service.state().time_ns() + 30'000'000'000);
  grpc::Status status;
  std::thread waiting([&] { status = service.set_target(request); });
  const auto begun = std::chrono::steady_clock::now();
  service.daemon->shutdown();
  waiting.join();
  // A call that was just coming in may be cut off by gRPC itself.
  EXPECT_TRUE(status.error_code() == grpc::StatusCode::UNAVAILABLE ||
              status.error_code() == grpc::StatusCode::CANCELLED)
      << status.error_message();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(25))
      << "it did not wait for the target";
}

TEST(ServiceTargets, TheFeasibleRangeFollowsTheEquation) {
  const RunningService service;
  const v1::RigInfo info = answer_of(*service.rig, &v1::RigService::Stub::GetRigInfo);
  const double f_max = info.device().max_force_n();
  v1::GetFeasibleRangeRequest request;
  request.set_hand_force_n(2.0 * f_max);
  request.set_object_stiffness_n_per_mm(0.4);
  v1::FeasibleRange range =
      answer_of(*service.rendering, &v1::RenderingService::Stub::GetFeasibleRange, request);
  EXPECT_NEAR(range.min_n_per_mm(), 0.4 * 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(range.max_n_per_mm(), 0.8, 1e-12);
  EXPECT_EQ(range.max_limited_by(), v1::LIMITING_REASON_DEVICE_FORCE);
  EXPECT_EQ(range.device_max_force_n(), f_max);

  request.set_hand_force_n(0.5 * f_max);
  ASSERT_TRUE(service.rendering->GetFeasibleRange(call_context().get(), request, &range).ok());
  EXPECT_NEAR(range.min_n_per_mm(), 0.4 / 3.0, 1e-12);
  EXPECT_TRUE(std::isinf(range.max_n_per_mm()));
  EXPECT_EQ(range.max_limited_by(), v1::LIMITING_REASON_NONE);

  ASSERT_TRUE(service.load_toml("name = \"gentle\"\n[target]\nmax_stiffness_n_per_mm = 0.75\n").ok());
  ASSERT_TRUE(service.rendering->GetFeasibleRange(call_context().get(), request, &range).ok());
  EXPECT_EQ(range.max_n_per_mm(), 0.75);
  EXPECT_EQ(range.max_limited_by(), v1::LIMITING_REASON_SCENE_MAXIMUM);
}

TEST(ServiceTargets, TheFeasibleRangeOfNowGoesByTheObjectsLawWhereItIsKnown) {
  const RunningService service;
  ASSERT_TRUE(service.load_toml("name = \"soft\"\nkind = \"explore\"\nobject_model = \"sponge_cut\"\n").ok());
  service.press(2.0, [](const v1::RigState& s) { return s.hand_force_n() > 1.0; });
  v1::GetFeasibleRangeRequest request;
  request.set_hand_force_n(4.0);
  v1::FeasibleRange range =
      answer_of(*service.rendering, &v1::RenderingService::Stub::GetFeasibleRange, request);
  EXPECT_GT(range.object_stiffness_n_per_mm(), 0.0);
  EXPECT_NEAR(range.min_n_per_mm(), 0.121, 0.001) << "4 N over the law's depth at 12.5 N";
  request.set_object_stiffness_n_per_mm(0.25);
  ASSERT_TRUE(service.rendering->GetFeasibleRange(call_context().get(), request, &range).ok());
  EXPECT_NEAR(range.min_n_per_mm(), 0.25 * 4.0 / 12.5, 1e-12) << "as the client says";
}

TEST(ServiceTargets, TheFeasibleRangeOfNowNeedsContact) {
  const RunningService service;
  v1::FeasibleRange range;
  expect_refused(service.rendering->GetFeasibleRange(call_context().get(), {}, &range),
                 grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_NO_SCENE, "scene");
  ASSERT_TRUE(service.load("tap_1d").ok());
  expect_refused(service.rendering->GetFeasibleRange(call_context().get(), {}, &range),
                 grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_NOT_IN_CONTACT,
                 "GetFeasibleRangeRequest.hand_force_n");
  v1::GetFeasibleRangeRequest request;
  request.set_hand_force_n(std::numeric_limits<double>::quiet_NaN());
  expect_refused(service.rendering->GetFeasibleRange(call_context().get(), request, &range),
                 grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID,
                 "GetFeasibleRangeRequest.hand_force_n");
  service.press(2.0, [](const v1::RigState& s) { return s.hand_force_n() > 1.0; });
  ASSERT_TRUE(ok(service.rendering->GetFeasibleRange(call_context().get(), {}, &range)));
  EXPECT_GT(range.object_stiffness_n_per_mm(), 0.0);
  EXPECT_LT(range.min_n_per_mm(), range.object_stiffness_n_per_mm());
}

TEST(TargetLog, NamesEachNewClientAndOtherwiseOneTargetASecond) {
  using std::chrono::milliseconds;
  server::TargetLog log;
  const server::TargetLog::Clock::time_point start{std::chrono::hours(1)};
  EXPECT_EQ(log.line("0.3 N/mm", "ipv4:a", start), "target 0.3 N/mm set by ipv4:a");
  for (int i = 1; i < 100; ++i) EXPECT_EQ(log.line("0.4 N/mm", "ipv4:a", start + milliseconds(10 * i)), "");
  EXPECT_EQ(log.line("0.5 N/mm", "ipv4:a", start + milliseconds(1000)),
            "target 0.5 N/mm set by ipv4:a (99 more since the last such line)");
  EXPECT_EQ(log.line("0.6 N/mm", "ipv4:b", start + milliseconds(1001)), "target 0.6 N/mm set by ipv4:b");
}

}  // namespace
}  // namespace hapticd::test
