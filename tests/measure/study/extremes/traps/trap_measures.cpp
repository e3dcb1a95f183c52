// Traps of numbers: what a staircase discards, and what an encoder resolves.

#include <cmath>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/device/device_model.h"
#include "rt/signal/adaptive_window_velocity.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

/// Stiffnesses at the reversals of a one-up one-down staircase as D§4.7 ran it: down from 1.4 N/mm, step 0.1
/// until `coarse` reversals, then 0.02, over at 15. The simulated subject feels the comparison harder with
/// a probability that is logistic about the true point of equality, 7 % of it wide.
std::vector<double> reversals(double equality, int coarse, sim::Random& random) {
  std::vector<double> at;
  double stiffness = 1.4;
  int before = 0;
  for (int trial = 0; at.size() < 15 && trial < 1000; ++trial) {
    const double harder = 1.0 / (1.0 + std::exp(-(stiffness - equality) / (0.07 * equality)));
    const int direction = random.uniform() < harder ? -1 : 1;
    if (before != 0 && direction != before) at.push_back(stiffness);
    before = direction;
    stiffness += direction * (static_cast<int>(at.size()) < coarse ? 0.1 : 0.02);
  }
  return at;
}

struct Threshold {
  double bias = 0.0, deviation = 0.0;  ///< over the truth
};

Threshold threshold(int discarded, int sessions) {
  sim::Random random(1);
  constexpr double kStart = 0.8;
  double sum = 0.0, squares = 0.0;
  for (int s = 0; s < sessions; ++s) {
    // Where steps begin to fall on the grid is chance.
    const double equality = kStart + 0.1 * (random.uniform() - 0.5);
    const std::vector<double> at = reversals(equality, 4, random);
    double mean = 0.0;
    for (std::size_t i = static_cast<std::size_t>(discarded); i < at.size(); ++i) mean += at[i];
    const double error =
        mean / static_cast<double>(at.size() - static_cast<std::size_t>(discarded)) / equality - 1.0;
    sum += error;
    squares += error * error;
  }
  const double n = sessions;
  return {sum / n, std::sqrt(squares / n - (sum / n) * (sum / n))};
}

/// rms error of the velocity of an even motion that breathes by a tenth, at this resolution.
double velocity_error(double resolution_mm, double speed_mm_per_s) {
  rt::AdaptiveWindowVelocity velocity(resolution_mm, 1000.0);
  double squares = 0.0;
  constexpr int kTicks = 20'000;
  for (int i = 0; i < kTicks; ++i) {
    // A speed that breathes by a tenth, so that no pattern of counts repeats.
    const double t = 1e-3 * i;
    const double x = speed_mm_per_s * (t + 0.1 * std::sin(3.0 * t) / 3.0);
    const double truth = speed_mm_per_s * (1.0 + 0.1 * std::cos(3.0 * t));
    const double error = velocity.update(resolution_mm * std::round(x / resolution_mm)) - truth;
    if (i > 100) squares += error * error;
  }
  return std::sqrt(squares / (kTicks - 101));
}

}  // namespace

Trap staircase_trap(bool quick) {
  const int sessions = quick ? 2000 : 20'000;
  Trap trap;
  trap.name = "10 staircase (D§4.7)";
  trap.fails =
      "the step shrinks after four reversals, but only three are discarded: one of coarse steps is averaged "
      "(hapticd runs no staircase yet; both belong among its parameters)";
  trap.predicts = "a coarse reversal is off by up to its step, 0.1 N/mm";
  trap.quantity = "bias of the threshold, mean of all sessions";
  trap.unit = "1";
  trap.limit = 0.5 * 0.02 / 0.8;  // half a fine step
  trap.plot_name = "staircase";
  trap.plot = small_plot("15 reversals, step 0.1 then 0.02 N/mm after four; true threshold 0.8 N/mm",
                         {"reversals discarded", ""}, {"of the threshold", "%"});
  report::PlotSeries bias{"bias"}, scatter = ours("scatter");
  bias.color = cli::palette(1);
  bias.line = report::PlotLine::kDashed;
  for (auto* series : {&bias, &scatter}) series->mark = report::PlotMark::kOfColor;
  for (int discarded = 0; discarded <= 8; ++discarded) {
    const Threshold t = threshold(discarded, sessions);
    bias.add(discarded, 100.0 * t.bias);
    scatter.add(discarded, 100.0 * t.deviation);
    if (discarded == 3) trap.forms.push_back({"published, 3 discarded", std::abs(t.bias)});
    if (discarded == 4) trap.forms.push_back({"4 discarded", std::abs(t.bias)});
    if (discarded == 6) trap.forms.push_back({"6 discarded", std::abs(t.bias)});
  }
  trap.plot.series = {bias, scatter};
  return trap;
}

Trap encoder_trap() {
  Trap trap;
  trap.name = "11 encoder resolution (D§4.8)";
  trap.fails = "0.03 mm is reported for both devices; the high-force device's data sheet says 0.007 mm";
  trap.predicts = "velocity error ≤ Δ/(15 T): 2.0 and 0.47 mm/s";
  trap.quantity = "velocity error at 20 mm/s, rms";
  trap.unit = "mm/s";
  trap.limit = 0.007 / 15e-3;
  trap.plot_name = "encoder";
  trap.plot =
      small_plot("Velocity by adaptive windowing", {"speed", "mm/s", true}, {"rms error", "mm/s", true});
  report::PlotSeries coarse = published("0.03 mm"), fine = ours("0.007 mm");
  const double sheet_mm = sim::device_preset("phantom_1_5_high_force")->encoder_resolution_mm;
  for (double speed = 1.0; speed < 250.0; speed *= 2.0) {
    coarse.add(speed, velocity_error(0.03, speed));
    fine.add(speed, velocity_error(sheet_mm, speed));
  }
  trap.plot.series = {coarse, fine};
  trap.forms = {{"published, 0.03 mm", velocity_error(0.03, 20.0)},
                {"here, by the data sheet", velocity_error(sheet_mm, 20.0)}};
  return trap;
}

}  // namespace hapticd::study::extremes
