// What real life adds to the clean rig: sensor, encoders, arm, tool and table.

#include "hal/sim/base/conditions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "hal/sim/device/arm_unevenness.h"
#include "hal/sim/device/base_vibration.h"
#include "tests/support/value_of.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::length;
using test::VirtualRig;
using Values = std::map<std::string, double>;

SimulationConfig with(const Values& values, const char* object = "none") {
  return {.object = object, .condition_values = values};
}

/// Mean reading over a second.
hal::Vector3 mean_reading(VirtualRig& rig, double seconds = 1.0) {
  hal::Vector3 sum;
  int count = 0;
  rig.run(seconds, [&] {
    sum = sum + rig.sample().sensor_force_n;
    ++count;
  });
  return sum * (1.0 / count);
}

TEST(Conditions, TheCleanRigHasNothingToReportAndTheLabEverything) {
  EXPECT_TRUE(uncertain(test::value_of(conditions_of("clean"))).empty());
  const auto lab = conditions_of("lab");
  ASSERT_TRUE(lab);
  std::vector<std::string> reported;
  for (const auto& parameter : uncertain(*lab)) {
    reported.push_back(parameter.name);
    EXPECT_FALSE(parameter.source.empty()) << parameter.name;
  }
  for (const char* name : {"sensor_drift_n_per_s", "sensor_crosstalk_share", "sensor_delay_ms",
                           "late_tick_share", "vibration_m_per_s2", "mass_anisotropy_share",
                           "friction_pose_share", "tool_mass_error_share", "tool_tilt_deg"}) {
    EXPECT_NE(std::find(reported.begin(), reported.end(), name), reported.end()) << name;
  }
  VirtualRig rig({.conditions = "lab"});
  std::size_t in_info = 0;
  for (const auto& parameter : rig.rig().info().uncertain) {
    in_info += static_cast<std::size_t>(std::count(reported.begin(), reported.end(), parameter.name));
  }
  EXPECT_EQ(in_info, reported.size());
}

TEST(Conditions, EveryFieldIsInRangeInBothPresetsAndRefusedBeyond) {
  const auto lab = test::value_of(conditions_of("lab"));
  for (const ConditionField& field : condition_fields()) {
    EXPECT_GE(lab.*field.value, field.low) << field.name;
    EXPECT_LE(lab.*field.value, field.high) << field.name;
    const auto refused = conditions_of("clean", {{std::string(field.name), field.high + 1.0}});
    ASSERT_FALSE(refused) << field.name;
    EXPECT_NE(refused.error().what.find(field.name), std::string::npos);
    EXPECT_EQ(refused.error().code, hal::ErrorCode::kOutOfRange);
  }
  EXPECT_EQ(conditions_of("clean", {{"sensor_drit", 0.1}}).error().code, hal::ErrorCode::kUnknownKey);
  EXPECT_EQ(conditions_of("barn").error().code, hal::ErrorCode::kUnknownWord);
  EXPECT_FALSE(conditions_of("clean", {{"vibration_low_hz", 70.0}}));
}

TEST(Conditions, TheLabIsBitRepeatableToo) {
  const auto bits = [](std::uint64_t seed) {
    SimulationConfig config{.object = "foam_ball", .seed = seed, .conditions = "lab"};
    VirtualRig rig(config, {.kind = HandProgram::Kind::kTap, .repetitions = -1});
    std::vector<double> values;
    double command_n = 0.0, max_n = 0.0;
    for (int i = 0; i < 4000; ++i) {
      rig.tick({0.1 * command_n, 0.0, command_n});
      const hal::RigSample& s = rig.sample();
      command_n = 0.3 * s.sensor_force_n.z;  // in closed loop, so that any difference would spread
      for (const hal::Vector3& v : {s.tip_position_mm, s.sensor_force_n, s.sensor_torque_n_mm,
                                    rig.truth().reaction_force_n, rig.truth().hand_force_n}) {
        values.insert(values.end(), {v.x, v.y, v.z});
      }
      values.insert(values.end(), {s.tip_orientation.x, static_cast<double>(s.time_ns)});
      max_n = std::max(max_n, rig.truth().normal_force_n);
    }
    EXPECT_GT(max_n, 0.5) << "it taps the object";
    return values;
  };
  EXPECT_EQ(bits(3), bits(3));  // so none is NaN
  EXPECT_NE(bits(3), bits(4));
}

TEST(SensorZero, DriftsAtItsRateAndTurnsBackAtItsBound) {
  VirtualRig rig(with({{"sensor_drift_n_per_s", 2e-3}, {"sensor_drift_bound_n", 0.03}}));
  rig.run(1.0);
  const hal::Vector3 before = mean_reading(rig);
  rig.run(8.0);
  const hal::Vector3 moved = mean_reading(rig) - before;
  for (const double axis : {moved.x, moved.y, moved.z}) EXPECT_NEAR(std::abs(axis), 2e-3 * 9.0, 1.5e-3);
  double max_n = 0.0;
  rig.run(40.0, [&] { max_n = std::max(max_n, std::abs(rig.sample().sensor_force_n.z)); });
  EXPECT_LT(max_n, 0.03 + 0.015) << "the bound and noise";
  EXPECT_GT(max_n, 0.025);
}

TEST(SensorZero, WandersNoFurtherThanItsBound) {
  VirtualRig rig(
      with({{"sensor_drift_n_per_s", 5e-3}, {"sensor_drift_bound_n", 0.02}, {"sensor_drift_wanders", 1.0}}));
  double min_n = 0.0, max_n = 0.0;
  rig.run(60.0, [&] {
    min_n = std::min(min_n, rig.sample().sensor_force_n.x);
    max_n = std::max(max_n, rig.sample().sensor_force_n.x);
  });
  EXPECT_LT(std::max(max_n, -min_n), 0.02 + 0.015);
  EXPECT_GT(max_n - min_n, 0.015);
}

TEST(SensorZero, StepsDoNotAddUp) {
  VirtualRig rig(with({{"sensor_step_n", 0.05}, {"sensor_step_interval_s", 0.5}}));
  rig.run(0.4);
  int off = 0, on = 0;
  for (int i = 0; i < 20; ++i) {
    const double reads_n = length(mean_reading(rig, 0.09));
    EXPECT_TRUE(std::abs(reads_n - 0.05) < 6e-3 || reads_n < 6e-3) << reads_n;
    ++(reads_n > 0.025 ? off : on);
    rig.run(0.41);
  }
  EXPECT_EQ(off, 10);
  EXPECT_EQ(on, 10);
}

TEST(SensorZero, CrossTalkIsAShareOfTheLoadInTheOtherAxes) {
  const HandProgram press{.kind = HandProgram::Kind::kPress, .force_n = 3.0, .hold_s = -1.0};
  VirtualRig clean(with({}, "rubber_eraser"), press);
  VirtualRig crossed(with({{"sensor_crosstalk_share", 0.05}}, "rubber_eraser"), press);
  clean.run(6.0);
  crossed.run(6.0);
  const hal::Vector3 is = mean_reading(crossed) - mean_reading(clean);
  EXPECT_NEAR(std::abs(is.x), 0.05 * 3.0, 0.02);
  EXPECT_NEAR(std::abs(is.y), 0.05 * 3.0, 0.02);
  EXPECT_NEAR(is.z, 0.0, 0.02);
}

TEST(SensorZero, NoiseIsThatOfAMeanOverAMillisecond) {
  VirtualRig rig(with({{"sensor_noise_n", 0.02}}));
  rig.run(0.5);
  double sum = 0.0;
  int count = 0;
  rig.run(2.0, [&] {
    const hal::Vector3& f = rig.sample().sensor_force_n;
    sum += f.x * f.x + f.y * f.y + f.z * f.z;
    ++count;
  });
  EXPECT_NEAR(std::sqrt(sum / (3.0 * count)), 0.0201, 0.001);
}

TEST(SensorZero, AtRestCrossTalkIsBiasedAway) {
  VirtualRig rig(with({{"sensor_crosstalk_share", 0.1}}));
  rig.run(1.0);
  EXPECT_LT(length(mean_reading(rig)), 2e-3);
}

TEST(SensorZero, ALoadDuringBiasingIsMissingAfterwards) {
  VirtualRig rig(with({{"bias_error_x_n", 0.1}, {"bias_error_z_n", -0.05}}));
  rig.run(1.0);
  const hal::Vector3 reads = mean_reading(rig);
  EXPECT_NEAR(reads.x, -0.1, 3e-3);
  EXPECT_NEAR(reads.z, 0.05, 3e-3);
}

TEST(Ages, ACleanMeanIsAsOldAsItsMiddle) {
  for (const auto& [rate_hz, age_ns] : {std::pair{1000.0, 450'000}, {5000.0, 50'000}, {10000.0, 0}}) {
    VirtualRig rig({.rate_hz = rate_hz});
    rig.run(0.2, [&, age = age_ns] {
      ASSERT_EQ(rig.sample().force_mean_age_ns, age);
      ASSERT_EQ(rig.sample().force_age_ns, 0);
      ASSERT_EQ(rig.sample().position_age_ns, 0);
    });
  }
}

class Delayed : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Ages, Delayed, testing::Bool(),
                         [](const auto& reported) { return reported.param ? "Reported" : "Unknown"; });

TEST_P(Delayed, SensorAndEncodersEachShowWhatWasSoLongAgo) {
  const HandProgram tap{.kind = HandProgram::Kind::kTap, .repetitions = -1};
  VirtualRig clean(with({}, "foam_ball"), tap);
  VirtualRig late(
      with({{"sensor_delay_ms", 3.0}, {"encoder_delay_ms", 2.0}, {"delays_reported", GetParam() ? 1.0 : 0.0}},
           "foam_ball"),
      tap);
  std::vector<double> forces_n, heights_mm;
  for (int i = 0; i < 4000; ++i) {
    clean.tick();
    late.tick();
    forces_n.push_back(clean.sample().sensor_force_n.z);
    heights_mm.push_back(clean.sample().tip_position_mm.z);
    if (i < 3) continue;
    ASSERT_EQ(late.sample().sensor_force_n.z, forces_n[static_cast<std::size_t>(i) - 3]) << i;
    ASSERT_EQ(late.sample().tip_position_mm.z, heights_mm[static_cast<std::size_t>(i) - 2]) << i;
    ASSERT_EQ(late.sample().force_age_ns, GetParam() ? 3'000'000 : 0);
    ASSERT_EQ(late.sample().force_mean_age_ns, GetParam() ? 3'450'000 : 450'000);
    ASSERT_EQ(late.sample().position_age_ns, GetParam() ? 2'000'000 : 0);
    ASSERT_EQ(late.sample().force_count, 10U);
  }
}

TEST(BaseVibration, PositionVelocityAndAccelerationBelongTogether) {
  for (const double interval_s : {0.0, 1.0}) {
    const auto conditions =
        conditions_of("clean", {{"vibration_m_per_s2", 1.0}, {"vibration_interval_s", interval_s}});
    ASSERT_TRUE(conditions);
    BaseVibration vibration(*conditions, 5);
    constexpr double kStepS = 1e-4;
    BaseMotion before = vibration.at(0.0);
    double max_mm_per_s2 = 0.0;
    for (double t = kStepS; t < 8.0; t += kStepS) {
      const BaseMotion now = vibration.at(t);
      const hal::Vector3 mean_v = (now.velocity_mm_per_s + before.velocity_mm_per_s) * 0.5;
      ASSERT_LT(length(now.position_mm - before.position_mm - mean_v * kStepS), 2e-5) << t;
      const hal::Vector3 mean_a = (now.acceleration_mm_per_s2 + before.acceleration_mm_per_s2) * 0.5;
      ASSERT_LT(length(now.velocity_mm_per_s - before.velocity_mm_per_s - mean_a * kStepS), 5e-3) << t;
      max_mm_per_s2 = std::max(max_mm_per_s2, length(now.acceleration_mm_per_s2));
      before = now;
    }
    EXPECT_GT(max_mm_per_s2, 500.0);
    EXPECT_LT(max_mm_per_s2, 2000.0);
  }
}

TEST(BaseVibration, TheSensorFeelsTheToolShakenInTheRoom) {
  const Values values{{"vibration_m_per_s2", 2.0}, {"vibration_interval_s", 1.0}};
  VirtualRig rig(with(values));
  BaseVibration table(*conditions_of("clean", values), 1);
  std::vector<hal::Vector3> tip_mm, base_mm_per_s2, sensor_n;
  rig.run(5.0, [&] {
    tip_mm.push_back(rig.truth().tip_position_mm);
    base_mm_per_s2.push_back(table.at(rig.time_s()).acceleration_mm_per_s2);
    sensor_n.push_back(rig.sample().sensor_force_n);
  });
  double worst_n = 0.0, largest_n = 0.0;
  for (std::size_t i = 1; i + 1 < tip_mm.size(); ++i) {
    const hal::Vector3 a = (tip_mm[i + 1] - tip_mm[i] * 2.0 + tip_mm[i - 1]) * 1e6 + base_mm_per_s2[i];
    const double expected_n = -1e-6 * 9.35 * a.x;
    const double read_n = 0.5 * (sensor_n[i].x + sensor_n[i + 1].x);  // the means of either side
    worst_n = std::max(worst_n, std::abs(read_n - expected_n));
    largest_n = std::max(largest_n, std::abs(read_n));
  }
  EXPECT_GT(largest_n, 0.01) << "it is shaken";
  EXPECT_LT(worst_n, 0.008) << "noise and steps of the sensor";
}

TEST(ArmUnevenness, StaysWithinItsSharesAndIsSmooth) {
  const auto conditions = conditions_of("clean", {{"mass_anisotropy_share", 0.2},
                                                  {"mass_pose_share", 0.1},
                                                  {"friction_anisotropy_share", 0.3},
                                                  {"friction_pose_share", 0.2}});
  const ArmUnevenness arm(*conditions);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double last = arm.mass_factor(axis, {-150.0, 20.0, -100.0});
    for (double s = -150.0; s < 150.0; s += 1.0) {
      const double mass = arm.mass_factor(axis, {s, 20.0, 0.7 * s + 5.0});
      ASSERT_GE(mass, arm.smallest_mass_factor() - 1e-12);
      ASSERT_LE(mass, arm.largest_mass_factor() + 1e-12);
      ASSERT_LT(std::abs(mass - last), 5e-3) << "over a millimetre";
      last = mass;
      ASSERT_GT(arm.friction_factor(axis, {s, 20.0, s}), 0.49);
      ASSERT_LT(arm.friction_factor(axis, {s, 20.0, s}), 1.51);
    }
  }
  EXPECT_GT(arm.mass_factor(0, {}), arm.mass_factor(2, {})) << "x is heavier than z";
}

TEST(ArmUnevenness, AHeavierDirectionMovesLess) {
  const auto swing_mm = [](double share, const hal::Vector3& direction) {
    VirtualRig rig(
        with({{"mass_anisotropy_share", share}}),
        {.kind = HandProgram::Kind::kShake, .force_n = 1.0, .rate_hz = 5.0, .shake_direction = direction});
    rig.run(1.0);
    double low = HUGE_VAL, high = -HUGE_VAL;
    rig.run(2.0, [&] {
      const double along = dot(rig.truth().tip_position_mm, direction);
      low = std::min(low, along);
      high = std::max(high, along);
    });
    return high - low;
  };
  const double even = swing_mm(0.0, {1.0, 0.0, 0.0});
  // 75 g of the arm of some 93 g vary; dry friction takes its part of the force.
  EXPECT_LT(swing_mm(0.3, {1.0, 0.0, 0.0}), 0.87 * even);
  EXPECT_GT(swing_mm(0.3, {0.0, 0.0, 1.0}), 1.15 * even);
}

TEST(Tool, TheTruthIsHeavierThanReported) {
  SimulationConfig config = with({{"tool_mass_error_share", 0.2}, {"tool_tilt_deg", 90.0}});
  config.tool_mass_g = 10.0;
  VirtualRig rig(config);
  EXPECT_EQ(rig.rig().info().sensor.tool_mass_g, 10.0);
  rig.run(1.0);
  // Biased upright, now lying on its side: the change of 12 g of weight.
  EXPECT_NEAR(length(mean_reading(rig)), 0.012 * 9.807 * std::numbers::sqrt2, 3e-3);
}

TEST(Tool, ATiltIsSeenByTheGimbalUnlessThatIsWrong) {
  const auto about_x_deg = [](const Values& values, double after_s) {
    VirtualRig rig(with(values));
    rig.run(after_s);
    double sum = 0.0;
    int count = 0;
    rig.run(4.0, [&] {
      const hal::Quaternion& q = rig.sample().tip_orientation;
      sum += 2.0 * std::atan2(q.x, q.w) * 180.0 / std::numbers::pi;
      ++count;
    });
    return sum / count;
  };
  EXPECT_NEAR(about_x_deg({}, 0.0), 0.0, 0.3);
  EXPECT_NEAR(about_x_deg({{"tool_tilt_deg", 20.0}}, 0.0), 20.0, 0.3);
  EXPECT_NEAR(about_x_deg({{"tool_tilt_deg", 20.0}, {"orientation_error_deg", 3.0}}, 0.0), 23.0, 0.3);
  EXPECT_NEAR(about_x_deg({{"tool_tilt_deg", 20.0}, {"tool_tilt_at_s", 6.0}}, 0.0), 0.0, 0.3);
  EXPECT_NEAR(about_x_deg({{"tool_tilt_deg", 20.0}, {"tool_tilt_at_s", 1.0}}, 2.0), 20.0, 0.3);
}

TEST(Dart, IsAsAbruptAsAsked) {
  SimulationConfig config = with({});
  VirtualRig rig(config, {.kind = HandProgram::Kind::kDart,
                          .speed_mm_per_s = 400.0,
                          .rate_hz = 1.0,
                          .hold_s = -1.0,
                          .stroke_length_mm = 60.0,
                          .shake_direction = {0.0, 0.0, 1.0},
                          .grip_stiffness_scale = 20.0,
                          .grip_damping_scale = 8.0,
                          .acceleration_m_per_s2 = 20.0});
  rig.run(2.0);
  std::vector<double> z_mm;
  rig.run(3.0, [&] { z_mm.push_back(rig.truth().tip_position_mm.z); });
  double fastest = 0.0, hardest = 0.0;
  for (std::size_t i = 10; i + 10 < z_mm.size(); ++i) {
    fastest = std::max(fastest, std::abs(z_mm[i + 1] - z_mm[i - 1]) * 500.0);
    hardest = std::max(hardest, std::abs(z_mm[i + 10] - 2.0 * z_mm[i] + z_mm[i - 10]) * 1e4);
  }
  EXPECT_NEAR(fastest, 400.0, 60.0);
  EXPECT_GT(hardest, 15e3);
  EXPECT_LT(hardest, 40e3);
  EXPECT_NEAR(*std::max_element(z_mm.begin(), z_mm.end()), 70.0, 3.0);
  EXPECT_NEAR(*std::min_element(z_mm.begin(), z_mm.end()), 10.0, 3.0);
}

TEST(Dart, EndsWhereItBeganWithoutAJump) {
  VirtualRig rig(with({}), {.kind = HandProgram::Kind::kDart,
                            .speed_mm_per_s = 300.0,
                            .rate_hz = 1.3,
                            .hold_s = 2.0,
                            .stroke_length_mm = 40.0,
                            .shake_direction = {0.0, 0.0, 1.0}});
  double last_mm = rig.truth().tip_position_mm.z, fastest = 0.0;
  int ticks = 0;
  rig.run(6.0, [&] {
    if (++ticks > 10) fastest = std::max(fastest, std::abs(rig.truth().tip_position_mm.z - last_mm) * 1e3);
    last_mm = rig.truth().tip_position_mm.z;
  });
  EXPECT_LT(fastest, 500.0);
  EXPECT_NEAR(last_mm, 10.0, 0.3);
  rig.run(1.0, [&] { ASSERT_NEAR(rig.truth().tip_position_mm.z, 10.0, 0.3); });
}

}  // namespace
}  // namespace hapticd::sim
