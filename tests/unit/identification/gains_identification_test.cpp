// The search for the ultimate gain, against a device that oscillates from a given gain on.

#include "server/identification/session/gains_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "identified.h"
#include "rt/control/force_controller.h"

namespace hapticd::identification {
namespace {

using namespace test;

hal::RigInfo rig() {
  hal::RigInfo info;
  info.rate_hz = 1000.0;
  info.device.structural_stiffness_n_per_mm = 3.5;
  info.device.position_resolution_mm = 0.03;
  return info;
}

/// Does what is requested, a tick at a time; a press oscillates where its gain is said to.
struct Bench {
  double from = 10.0, to = 10.0;  ///< gains that oscillate at 12 Hz
  double low = 0.0;               ///< gains below it do, too
  double growth_per_s = 0.0;
  double latch_from = 10.0;  ///< the guard cuts the force while such a gain is pressed
  double run_away_from = 10.0;
  std::int64_t time_ns = 0;
  double longest_swing_s = 0.0;  ///< oscillating before it was asked to let go
  double highest_gain = 0.0;

  bool oscillates(double gain) const { return (gain >= from && gain < to) || gain < low; }

  /// False when nothing more is wanted.
  bool next_request(GainsIdentification& identification) {
    const MotionRequest w = identification.next_request();
    if (w.motion == MotionRequest::Motion::kRest && w.hold_s <= 0.0) return false;
    highest_gain = std::max(highest_gain, w.proportional_gain);
    EXPECT_TRUE(
        w.device == MotionRequest::Device::kNothing ||
        rt::gains_are_stable({rt::ControlLaw::kClosedLoop, w.proportional_gain, w.derivative_ms}, 1000.0));
    const double duration_s = w.device == MotionRequest::Device::kModulation ? 2.0 : 0.6;
    double swinging_s = 0.0;
    for (int i = 0; i < static_cast<int>(1e3 * duration_s); ++i) {
      const double t = 1e-3 * i;
      rt::Observation o;
      time_ns += 1'000'000;
      o.sample.time_ns = time_ns;
      o.sample.tip_position_mm = {0.0, 0.0, 10.0};
      const bool pressing = w.device == MotionRequest::Device::kModulation && t > 0.2 && t < 1.6;
      if (pressing) {
        const double ramp = std::min(1.0, (t - 0.2) / 0.3);
        double swing = 0.0;
        if (oscillates(w.proportional_gain)) {
          swing = 0.2 * std::exp(growth_per_s * (t - 0.2)) * std::sin(2.0 * 3.14159265 * 12.0 * t);
          swinging_s += 1e-3;
        } else {
          swing = 0.2 * std::exp(-(t - 0.2) / 0.05) * std::sin(2.0 * 3.14159265 * 12.0 * t);
        }
        o.sample.tip_position_mm.z = -2.0 * ramp + swing;
        o.sample.sensor_force_n = {0.0, 0.0, 0.6 * ramp};
        o.device_command_n = {0.0, 0.0, 1.4 * ramp - swing};
        if (w.proportional_gain >= run_away_from) o.device_command_n.z = 1.4 + 20.0 * (t - 0.2);
        if (w.proportional_gain >= latch_from && t > 0.8) o.device_command_n = {};
      }
      identification.add(o);
      if (w.device == MotionRequest::Device::kModulation &&
          identification.next_request().device == MotionRequest::Device::kNothing) {
        break;  // obeyed at once
      }
    }
    longest_swing_s = std::max(longest_swing_s, swinging_s);
    return true;
  }
  void run(GainsIdentification& identification) {
    for (int i = 0; i < 100; ++i) {
      if (!next_request(identification)) return;
    }
    ADD_FAILURE() << "never comes to an end";
  }
};

/// A search that has come to its end.
struct Search {
  explicit Search(const Bench& device = {}) : bench(device) { bench.run(identification); }

  Bench bench;
  GainsIdentification identification{{1.0}, rig()};
};

TEST(GainsIdentification, FindsWhereItOscillatesAndTakesSixTenths) {
  Search search({.from = 1.2});
  const auto model = value_of(search.identification.finish());
  EXPECT_TRUE(model.converged);
  const auto& gains = std::get<rt::GainsModel>(model.content);
  EXPECT_GE(gains.ultimate_gain, 1.2);
  EXPECT_LE(gains.ultimate_gain, 1.2 * GainsIdentification::kStep);
  EXPECT_NEAR(gains.proportional_gain, 0.6 * gains.ultimate_gain, 1e-9);
  EXPECT_NEAR(gains.ultimate_period_ms, 1e3 / 12.0, 3.0);
  EXPECT_TRUE(rt::gains_are_stable(
      {rt::ControlLaw::kClosedLoop, gains.proportional_gain, gains.derivative_ms}, 1000.0));
  EXPECT_LT(search.bench.longest_swing_s, 0.7) << "half a second after the touch has settled";
  EXPECT_LT(search.bench.highest_gain, 1.2 * GainsIdentification::kStep + 1e-9) << "no step beyond";
  EXPECT_EQ(search.identification.progress().coverage.front().share, 1.0);
}

TEST(GainsIdentification, SaysWhenTheControllersOwnLimitComesFirst) {
  Search search;
  const auto model = search.identification.finish();
  ASSERT_TRUE(model);
  EXPECT_EQ(std::get<rt::GainsModel>(model->content).ultimate_gain, GainsIdentification::kControllerLimit);
  EXPECT_LT(search.bench.highest_gain, GainsIdentification::kControllerLimit);
  EXPECT_TRUE(std::isinf(model->parameters.front().standard_error));
  EXPECT_TRUE(has_remark(search.identification, "lower bound"));
  // Chosen, not estimated; and all that the search tries was tried.
  EXPECT_EQ(parameter(*model, "proportional_gain").standard_error, 0.0);
  EXPECT_TRUE(model->converged);
  EXPECT_EQ(search.identification.progress().coverage.front().share, 1.0);
}

TEST(GainsIdentification, PassesThroughGainsThatAreTooLow) {
  Search search({.from = 1.5, .low = 0.5});
  const auto model = value_of(search.identification.finish());
  EXPECT_TRUE(model.converged);
  EXPECT_GE(std::get<rt::GainsModel>(model.content).ultimate_gain, 1.5);
}

TEST(GainsIdentification, GivesUpWhereNoGainHolds) {
  Search search({.from = 0.0});
  EXPECT_TRUE(holds(refusal_of(search.identification).value, "no gain"));
}

TEST(GainsIdentification, AGrowingOscillationIsNotWaitedFor) {
  Search search({.from = 0.9, .growth_per_s = 12.0});
  EXPECT_LT(search.bench.longest_swing_s, 0.45);
}

TEST(GainsIdentification, EndsWhereTheGuardLatched) {
  Search search({.latch_from = 0.6});
  EXPECT_TRUE(holds(refusal_of(search.identification).value, "guard"));
  EXPECT_LT(search.bench.highest_gain, 0.6 * GainsIdentification::kStep);
  EXPECT_EQ(search.identification.next_request().device, MotionRequest::Device::kNothing);
}

/// Ticks of a hand that presses for so long, without or with force of the device, and lets go.
void press(GainsIdentification& identification, std::int64_t& time_ns, double seconds, double device_n) {
  for (int i = 0; i < static_cast<int>(1e3 * (seconds + 0.6)); ++i) {
    rt::Observation o;
    o.sample.time_ns = time_ns += 1'000'000;
    if (1e-3 * i < seconds) {
      o.sample.sensor_force_n = {0.0, 0.0, 0.8};
      o.device_command_n = {0.0, 0.0, device_n};
    }
    identification.add(o);
  }
}

TEST(GainsIdentification, APressThatBeganBeforeTheDeviceRenderedIsAskedForAgain) {
  GainsIdentification identification({1.0}, rig());
  std::int64_t time_ns = 0;
  press(identification, time_ns, 0.0, 0.0);
  press(identification, time_ns, 1.5, 0.0);
  press(identification, time_ns, 1.5, 0.0);
  EXPECT_EQ(identification.next_request().device, MotionRequest::Device::kModulation) << "two were lost";
  press(identification, time_ns, 1.5, 1.0);
  const IdentificationProgress progress = identification.progress();
  ASSERT_FALSE(progress.parameters.empty());
  EXPECT_EQ(progress.parameters.front().name, "highest_holding_gain");
  EXPECT_EQ(progress.parameters.front().value, GainsIdentification::kFirstGain);
}

TEST(GainsIdentification, GivesUpWhereTheDeviceNeverRenders) {
  GainsIdentification identification({1.0}, rig());
  std::int64_t time_ns = 0;
  press(identification, time_ns, 0.0, 0.0);
  for (int i = 0; i < GainsIdentification::kMaxLostPresses; ++i) {
    EXPECT_EQ(identification.next_request().device, MotionRequest::Device::kModulation) << i;
    press(identification, time_ns, 1.5, 0.0);
  }
  EXPECT_EQ(identification.next_request().device, MotionRequest::Device::kNothing);
  EXPECT_TRUE(holds(refusal_of(identification).value, "gives no force"));
}

TEST(GainsIdentification, EndsWhereTheForceRunsAway) {
  Search search({.run_away_from = 0.0});
  EXPECT_TRUE(holds(refusal_of(search.identification).value, "ran away"));
}

TEST(GainsIdentification, RefusesRecordingsAndTargetsThatNothingRenders) {
  hal::RigInfo recording = rig();
  recording.kind = hal::RigKind::kReplay;
  recording.renders_force = false;
  EXPECT_FALSE(GainsIdentification({1.0}, recording).finish());
  for (const double target : {0.0, -1.0, 3.0, std::numeric_limits<double>::quiet_NaN()}) {
    const GainsIdentification identification({target}, rig());
    EXPECT_FALSE(identification.finish());
    EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest);
  }
}

TEST(UltimateOscillation, TellsWhatLastsFromWhatDies) {
  struct Case {
    double hz, amplitude, decay_s;
    bool sustained;
  };
  for (const Case& c : {Case{12.0, 0.2, 1e9, true}, Case{80.0, 0.1, 1e9, true}, Case{12.0, 0.2, 0.1, false},
                        Case{1.0, 5.0, 1e9, false}, Case{9.0, 0.03, 1e9, false}}) {
    UltimateOscillation oscillation(1000.0, 0.05, 2.0);
    for (int i = 0; i < 1500; ++i) {
      const double t = 1e-3 * i;
      oscillation.update(-3.0 * std::min(1.0, t) +
                         c.amplitude * std::exp(-t / c.decay_s) * std::sin(2.0 * 3.14159265 * c.hz * t));
    }
    EXPECT_EQ(oscillation.sustained(), c.sustained) << c.hz << " Hz, " << c.amplitude << " mm";
    if (c.sustained) {
      EXPECT_NEAR(oscillation.period_s(), 1.0 / c.hz, 0.1 / c.hz);
    }
    EXPECT_FALSE(oscillation.violent());
  }
}

TEST(UltimateOscillation, TakesNoNotNumbers) {
  UltimateOscillation oscillation(1000.0, 0.05, 2.0);
  for (int i = 0; i < 1000; ++i)
    oscillation.update(i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN() : 0.0);
  EXPECT_FALSE(oscillation.sustained());
}

}  // namespace
}  // namespace hapticd::identification
