#include "rt/guard/oscillation_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "rt/guard/guard.h"

namespace hapticd::rt {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// A mass with a damper that a force shakes: what hand and device do with an oscillating command.
struct ShakenHand {
  double mass_kg = 0.3;
  double damping_ns_per_m = 5.0;
  double speed_mm_per_s = 0.0;

  /// Step over an interval, mm.
  double step_mm(double force_n, double interval_s) {
    speed_mm_per_s += interval_s * 1e3 * (force_n - 1e-3 * damping_ns_per_m * speed_mm_per_s) / mass_kg;
    return speed_mm_per_s * interval_s;
  }
};

/// Time when the monitor first said so of a command at an amplitude and a frequency, s; nothing within 10 s.
std::optional<double> noticed_after_s(double amplitude_n, double frequency_hz, double rate_hz) {
  OscillationMonitor monitor;
  ShakenHand hand;
  const double period_s = 1.0 / rate_hz;
  double force_n = 0.0;
  for (int i = 1; i <= static_cast<int>(10.0 * rate_hz); ++i) {
    const double time_s = i * period_s;
    const hal::Vector3 step{0.0, 0.0, hand.step_mm(force_n, period_s)};
    if (monitor.update({0.0, 0.0, force_n}, step, static_cast<std::int64_t>(1e9 * time_s))) return time_s;
    force_n = amplitude_n * std::sin(kTwoPi * frequency_hz * time_s);
  }
  return std::nullopt;
}

TEST(OscillationMonitor, NoticesAClearOscillationWithinHalfASecondAtAnyRate) {
  for (const double rate_hz : {500.0, 1000.0, 5000.0, 10000.0}) {
    for (const double frequency_hz : {20.0, 30.0, 45.0, 60.0}) {
      const auto after_s = noticed_after_s(4.0, frequency_hz, rate_hz);
      ASSERT_TRUE(after_s) << frequency_hz << " Hz at " << rate_hz << " Hz";
      EXPECT_LE(*after_s, 0.4) << frequency_hz << " Hz at " << rate_hz << " Hz";
    }
  }
}

TEST(OscillationMonitor, LeavesWhatAHandCanDoAndWhatItDoesNotFeel) {
  for (const double rate_hz : {1000.0, 5000.0}) {
    for (const double frequency_hz : {1.0, 3.0, 5.0, 8.0, 10.0}) {
      EXPECT_FALSE(noticed_after_s(8.0, frequency_hz, rate_hz)) << frequency_hz << " Hz";
    }
    EXPECT_FALSE(noticed_after_s(1.4, 40.0, rate_hz)) << "below the swing that counts";
  }
}

TEST(OscillationMonitor, AHandThatPaysForItIsNoOscillation) {
  // A spring of 1 N/mm that a strong hand moves by 4 mm at 8 Hz, with a law that crosses zero four times a
  // cycle.
  OscillationMonitor monitor;
  double before_mm = 0.0;
  double force_n = 0.0;
  for (int i = 1; i < 10000; ++i) {
    const double place_mm = 4.0 * std::sin(kTwoPi * 4.0 * 1e-3 * i);
    EXPECT_FALSE(monitor.update({force_n, 0.0, 0.0}, {place_mm - before_mm, 0.0, 0.0}, 1'000'000LL * i));
    before_mm = place_mm;
    force_n = 2.0 * std::cos(kTwoPi * 8.0 * 1e-3 * i);
  }
  // Faster than any hand, but against the motion all the time: a brake.
  monitor.reset();
  for (int i = 1; i < 10000; ++i) {
    const double step_mm = 0.1 * std::sin(kTwoPi * 40.0 * 1e-3 * i);
    EXPECT_FALSE(monitor.update({-40.0 * step_mm, 0.0, 0.0}, {step_mm, 0.0, 0.0}, 1'000'000LL * i));
  }
}

TEST(OscillationMonitor, TapsAndNoiseAreNone) {
  OscillationMonitor monitor;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.2);
  for (int i = 1; i < 20000; ++i) {
    const bool touches = (i / 100) % 2 == 0;  // 5 Hz, and the tip gives way all the time
    const double force_n = (touches ? -8.5 : 0.0) + noise(random);
    EXPECT_FALSE(monitor.update({0.0, 0.0, force_n}, {0.0, 0.0, -0.01}, 1'000'000LL * i));
  }
}

TEST(OscillationMonitor, ASwingOnOneSideOfZeroCountsToo) {
  OscillationMonitor monitor;
  ShakenHand hand;
  bool noticed = false;
  double force_n = 0.0;
  for (int i = 1; i < 1000 && !noticed; ++i) {
    const hal::Vector3 step{0.0, hand.step_mm(force_n, 1e-3), 0.0};
    noticed = monitor.update({0.0, 4.0 + force_n, 0.0}, step, 1'000'000LL * i);
    force_n = 4.0 * std::sin(kTwoPi * 25.0 * 1e-3 * i);
  }
  EXPECT_TRUE(noticed);
}

TEST(OscillationMonitor, ARecordingThatIsPlayedRoundAndRoundGoesBackInTimeAndSwingsNoFaster) {
  GuardLimits limits;
  limits.max_force_n = 8.5;
  limits.max_force_rate_n_per_s = 1e5;
  limits.max_power_w = 100.0;
  Guard guard(limits, 1000.0);
  double force_n = 0.0;
  hal::RigSample sample;
  for (int tick = 0; tick < 40'000; ++tick) {
    const int in_round = tick % 1000;
    const double wanted_n = in_round < 500 ? 4.0 : -4.0;
    sample.tick = static_cast<std::uint64_t>(tick);
    sample.time_ns = 1'000'000LL * in_round;
    sample.tip_position_mm.z += 1e-3 * force_n;
    force_n = guard.release(guard.admit(sample), {0.0, 0.0, wanted_n}, 0).z;
    ASSERT_EQ(guard.state(), GuardState::kRendering) << "after " << tick << " ticks";
  }
}

TEST(OscillationMonitor, TheGuardCutsAndLatchesAndWatchesAgainAfterAClear) {
  GuardLimits limits;
  limits.max_force_n = 8.5;
  limits.max_force_rate_n_per_s = 1e5;
  limits.max_power_w = 100.0;
  limits.resume_ramp_s = 0.1;
  Guard guard(limits, 1000.0);
  ShakenHand hand;
  hal::RigSample sample;
  double force_n = 0.0;
  const auto run_until_latched = [&] {
    for (int i = 0; i < 2000 && guard.state() != GuardState::kLatched; ++i) {
      ++sample.tick;
      sample.time_ns = static_cast<std::int64_t>(sample.tick) * 1'000'000;
      sample.tip_position_mm.z += hand.step_mm(force_n, 1e-3);
      const double wanted_n = 4.0 * std::sin(kTwoPi * 30.0 * 1e-9 * static_cast<double>(sample.time_ns));
      force_n = guard.release(guard.admit(sample), {0.0, 0.0, wanted_n}, 0).z;
    }
    return guard.state() == GuardState::kLatched;
  };
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(run_until_latched());
    EXPECT_EQ(guard.fault(), GuardFault::kOscillation);
    TickRecord record;
    guard.fill_record(record);
    EXPECT_EQ(record.faults_present, set_of(GuardFault::kOscillation));
    EXPECT_EQ(force_n, 0.0) << "in the tick in which it is noticed";
    EXPECT_FALSE(guard.clear()) << "still in the last sample";
    sample.time_ns = static_cast<std::int64_t>(++sample.tick) * 1'000'000;
    guard.release(guard.admit(sample), {}, 0);
    EXPECT_TRUE(guard.clear());
  }
}

}  // namespace
}  // namespace hapticd::rt
