#include "server/config/guard_ceilings.h"

#include <gtest/gtest.h>

#include "hal/sim/simulated_rig.h"
#include "server/config/config.h"
#include "tests/support/refusals.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

hal::RigInfo rig(const char* device = "phantom_1_0") {
  return (*sim::SimulatedRig::create({.device = device}))->info();
}

/// Filled, resolved and checked as the daemon does it.
std::optional<hal::Error> refusal_of(rt::SceneSpec scene, const GuardCeilings& ceilings = {},
                                     const hal::RigInfo& on = rig()) {
  std::vector<std::string> remarks;
  fill_from_ceilings(ceilings, on.device, scene, remarks);
  const auto resolved = rt::resolve(scene, on);
  if (!resolved) return resolved.error();
  return check_ceilings(ceilings, on.device, *resolved);
}

rt::SceneSpec scene(rt::SceneKind kind = rt::SceneKind::kTap1d) {
  rt::SceneSpec spec;
  spec.name = "x";
  spec.kind = kind;
  return spec;
}

TEST(GuardCeilings, LetSceneDefaultsPassUnchanged) {
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (const rt::SceneKind kind : {rt::SceneKind::kTap1d, rt::SceneKind::kWall, rt::SceneKind::kExplore}) {
      rt::SceneSpec plain = scene(kind);
      std::vector<std::string> remarks;
      fill_from_ceilings({}, rig(device).device, plain, remarks);
      EXPECT_TRUE(remarks.empty()) << remarks.front();
      EXPECT_EQ(plain.guard.max_force_n, 0.0) << "still the device's own";
      const auto refused = refusal_of(scene(kind), {}, rig(device));
      EXPECT_FALSE(refused) << refused->text();
    }
  }
}

TEST(GuardCeilings, RefuseEveryKeyThatAsksForMoreByName) {
  using enum hal::ErrorCode;
  struct Case {
    const char* key;
    void (*ask)(rt::SceneSpec&);
    const char* limit;
  };
  const Case cases[] = {
      {"guard.max_power_w", [](rt::SceneSpec& s) { s.guard.max_power_w = 100.0; }, "at most 2.5 W"},
      {"guard.sensor_stale_after_ms", [](rt::SceneSpec& s) { s.guard.sensor_stale_after_ms = 1000.0; },
       "at most 5 ms"},
      {"guard.loop_gap_ms", [](rt::SceneSpec& s) { s.guard.loop_gap_ms = 0.0; }, "at most 50 ms"},
      {"guard.loop_gap_ms", [](rt::SceneSpec& s) { s.guard.loop_gap_ms = 1000.0; }, "at most 50 ms"},
      {"guard.resume_ramp_s", [](rt::SceneSpec& s) { s.guard.resume_ramp_s = 0.0; }, "at least 0.25 s"},
      {"guard.fall_ramp_s", [](rt::SceneSpec& s) { s.guard.fall_ramp_s = 1.0; }, "at most 0.2 s"},
      {"target.ramp_s", [](rt::SceneSpec& s) { s.target_ramp_s = 0.0; }, "at least 0.1 s"},
      {"target.max_stiffness_n_per_mm", [](rt::SceneSpec& s) { s.max_target_stiffness_n_per_mm = 1000.0; },
       "at most 1 N/mm"},
      // A rigid device by the scene's own word lifts nothing.
      {"target.max_stiffness_n_per_mm",
       [](rt::SceneSpec& s) {
         s.structural_compensation = false;
         s.max_target_stiffness_n_per_mm = 1000.0;
       },
       "at most 1 N/mm"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.key);
    rt::SceneSpec asking = scene();
    c.ask(asking);
    const auto refused = test::error_of(refusal_of(asking));
    EXPECT_EQ(refused.where, std::string("scene 'x', ") + c.key);
    EXPECT_EQ(refused.code, kOutOfRange);
    EXPECT_TRUE(refused.limit.starts_with(c.limit)) << refused.limit;
  }
  rt::SceneSpec fast = scene();
  fast.guard.max_power_w = 100.0;
  test::expect_same(refusal_of(fast).value_or(hal::Error{}),
                    {"more than this daemon allows", "scene 'x', guard.max_power_w", "100 W",
                     "at most 2.5 W ([guard] max_power_w)",
                     "change the scene, or raise max_power_w under [guard] in the daemon's configuration and "
                     "start it again",
                     kOutOfRange});
}

TEST(GuardCeilings, OfTheRateOfForceAreBelowWhatTheDeviceAllows) {
  GuardCeilings low{.max_force_rate_n_per_s = 200.0};
  rt::SceneSpec fast = scene();
  fast.guard.max_force_rate_n_per_s = 400.0;
  EXPECT_FALSE(refusal_of(fast));
  const auto refused = test::error_of(refusal_of(fast, low));
  EXPECT_EQ(refused.limit, "at most 200 N/s ([guard] max_force_rate_n_per_s)");
  GuardCeilings high{.max_force_rate_n_per_s = 1e6};
  fast.guard.max_force_rate_n_per_s = 1e6;
  EXPECT_TRUE(refusal_of(fast, high)) << "no ceiling lifts the device's own";
}

TEST(GuardCeilings, AWallHasOneOfItsOwn) {
  rt::SceneSpec wall = scene(rt::SceneKind::kWall);
  wall.structural_compensation = false;
  wall.max_target_stiffness_n_per_mm = 5.0;
  EXPECT_FALSE(refusal_of(wall, {}, rig("phantom_1_5_high_force")));
  const auto refused = test::error_of(refusal_of(wall));
  EXPECT_EQ(refused.limit, "at most 1.3 N/mm ([guard] max_wall_stiffness_n_per_mm)");
}

TEST(GuardCeilings, LowerOnesTakeThePlaceOfWhatASceneDoesNotSay) {
  GuardCeilings low{.max_force_n = 3.0,
                    .max_force_rate_n_per_s = 200.0,
                    .max_power_w = 1.0,
                    .max_target_stiffness_n_per_mm = 0.8,
                    .min_target_ramp_s = 0.5,
                    .min_resume_ramp_s = 2.0,
                    .max_sensor_stale_after_ms = 1.5,
                    .max_loop_gap_ms = 10.0};
  rt::SceneSpec filled = scene();
  std::vector<std::string> remarks;
  fill_from_ceilings(low, rig().device, filled, remarks);
  EXPECT_EQ(filled.guard.max_force_n, 3.0);
  EXPECT_EQ(filled.guard.max_force_rate_n_per_s, 200.0);
  EXPECT_EQ(filled.guard.max_power_w, 1.0);
  EXPECT_EQ(filled.max_target_stiffness_n_per_mm, 0.8);
  EXPECT_EQ(filled.target_ramp_s, 0.5);
  EXPECT_EQ(filled.guard.resume_ramp_s, 2.0);
  EXPECT_EQ(filled.guard.sensor_stale_after_ms, 1.5);
  EXPECT_EQ(filled.guard.loop_gap_ms, 10.0);
  EXPECT_EQ(remarks.size(), 8U);
  EXPECT_EQ(remarks.front(), "guard.max_force_n = 3 N: [guard] max_force_n of the daemon's configuration");
  EXPECT_FALSE(refusal_of(scene(), low));

  rt::SceneSpec asking = scene();
  asking.guard.max_force_n = 4.0;
  EXPECT_EQ(test::error_of(refusal_of(asking, low)).limit, "at most 3 N ([guard] max_force_n)");

  rt::SceneSpec gentle = scene();
  gentle.guard.max_force_n = 1.0;
  EXPECT_FALSE(refusal_of(gentle, low)) << "less may always be asked for";
}

TEST(GuardCeilings, AreOfTheConfigurationWhereTheChecksAreNeverOff) {
  using enum hal::ErrorCode;
  const auto config =
      parse_config("[guard]\nmax_power_w = 1\nmax_sensor_stale_after_ms = 20\nmin_target_ramp_s = 0\n", "x");
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->guard.max_power_w, 1.0);
  EXPECT_EQ(config->guard.max_sensor_stale_after_ms, 20.0);
  EXPECT_EQ(config->guard.min_target_ramp_s, 0.0);
  const auto again = test::value_of(parse_config(write_config(*config), "again"));
  EXPECT_EQ(again.guard.max_sensor_stale_after_ms, 20.0);
  EXPECT_EQ(again.guard.max_loop_gap_ms, 50.0);
  test::expect_refusals(
      {
          {"[guard]\nmax_sensor_stale_after_ms = 0\n", "'guard.max_sensor_stale_after_ms'", kOutOfRange, 2},
          {"[guard]\nmax_loop_gap_ms = 0\n", "'guard.max_loop_gap_ms'", kOutOfRange, 2},
          {"[guard]\nmax_power_w = inf\n", "'guard.max_power_w'", kNotFinite, 2},
          {"[guard]\nmax_power_w = 0\n", "'guard.max_power_w'", kOutOfRange, 2},
          {"[guard]\nmin_resume_ramp_s = -1\n", "'guard.min_resume_ramp_s'", kOutOfRange, 2},
          {"[guard]\nmax_pover_w = 1\n", "'max_pover_w'", kUnknownKey, 2},
      },
      [](const std::string& text) { return parse_config(text, "x"); });
}

}  // namespace
}  // namespace hapticd::server
