#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "rt/guard/load_monitor.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::test {

/// A tool on a hand's path, with encoders of 0.03 mm and a noisy sensor; its motion, its zero and what it
/// touches are the test's.
class WatchedTool {
 public:
  static constexpr double kMassG = 12.6;
  static constexpr hal::Vector3 kAxes[] = {{1.0, 0.0, 0.0},  {0.0, 1.0, 0.0},  {0.0, 0.0, 1.0},
                                           {-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {0.0, 0.0, -1.0}};

  explicit WatchedTool(double rate_hz = 1000.0, std::uint32_t seed = 5)
      : period_s_(1.0 / rate_hz), random_(seed) {
    watch.set_parameters({kMassG, {}, {}, false});
    sample.bias_serial = 1;
  }
  /// Waved ±20 mm at 2.2 Hz along all axes, from within half a second on.
  void wave() { swing(20.0); }
  void rest() {
    swing(0.0);
    run(0.6);
  }
  void run(double seconds) {
    for (const double until_s = time_s + seconds; time_s < until_s - 1e-9;) tick();
  }
  void tick() {
    ++ticks_;
    double step_s = period_s_;
    if (late_s > 0.0 && ticks_ % 47 == 0) step_s += late_s;
    if (late_s > 0.0 && ticks_ % 47 == 1) step_s -= late_s;
    time_s += step_s;
    place_ = path(time_s);
    constexpr double dt = 1e-3;
    const hal::Vector3 a = (path(time_s + dt) + path(time_s - dt) - path(time_s) * 2.0) * (1.0 / (dt * dt));
    const auto counted = [](double mm) { return 0.03 * std::round(mm / 0.03); };
    sample.tip_position_mm = {counted(place_.x), counted(place_.y), counted(place_.z)};
    sample.sensor_force_n = zero_n + load_n - a * rt::inertial_force_n(kMassG, 1.0) +
                            hal::Vector3{normal_(random_), normal_(random_), normal_(random_)} * noise_n;
    sample.time_ns += static_cast<std::int64_t>(1e9 * step_s);
    watch.update(sample, step_s);
  }
  /// Settles in free air, its zero proven.
  void settle() {
    wave();
    run(1.0);
    ASSERT_FALSE(watch.is_waiting());
  }

  /// Presses onto a spring along -z with 2 N, which takes 0.4 s, and holds.
  void press() {
    for (int i = 0; i < 400; ++i) {
      offset_mm.z -= 0.01;
      load_n.z = 0.005 * (i + 1);
      tick();
    }
    run(0.2);
  }

  rt::LoadMonitor watch;
  hal::RigSample sample;
  hal::Vector3 zero_n;
  hal::Vector3 load_n;
  hal::Vector3 offset_mm;
  double time_s = 0.0;
  double late_s = 0.0;     ///< of each 47th tick
  double noise_n = 0.003;  ///< of each axis

 private:
  void swing(double amplitude_mm) {
    amplitude_from_mm_ = amplitude_at(time_s);
    amplitude_mm_ = amplitude_mm;
    swing_from_s_ = time_s;
  }
  double amplitude_at(double t) const {  // minimum jerk
    const double x = std::clamp((t - swing_from_s_) / 0.5, 0.0, 1.0);
    return amplitude_from_mm_ +
           (amplitude_mm_ - amplitude_from_mm_) * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
  }
  hal::Vector3 path(double t) const {
    const double w = 2.0 * std::numbers::pi * 2.2;
    return offset_mm +
           hal::Vector3{std::sin(w * t), std::sin(1.1 * w * t + 1.0), std::sin(0.9 * w * t + 2.0)} *
               amplitude_at(t);
  }

  double period_s_;
  int ticks_ = 0;
  double amplitude_mm_ = 0.0;
  double amplitude_from_mm_ = 0.0;
  double swing_from_s_ = -1.0;
  hal::Vector3 place_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// A tool at rest in free air, its zero proven.
inline WatchedTool tool_at_rest() {
  WatchedTool tool;
  tool.settle();
  tool.rest();
  return tool;
}
/// A tool that was at rest, pressed.
inline WatchedTool pressed_tool() {
  WatchedTool tool = tool_at_rest();
  tool.press();
  return tool;
}

}  // namespace hapticd::test
