// Traps of the controller: unit of K_d (3.6), what it is without K_d, the limit of stability in 1D.

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include "rt/control/force_controller.h"
#include "tests/measure/study/extremes/spectral_radius.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;

/// Deviation of the command from 1 N that is asked for from the start.
std::vector<double> step_course(double kp, double kd_per_sample, int samples) {
  // (3.6) as it ships; its K_d is in milliseconds, which at 1 kHz is per sample.
  rt::ForceController controller({rt::ControlLaw::kClosedLoop, kp, kd_per_sample}, kRateHz);
  std::vector<double> course;
  for (int i = 0; i < samples; ++i) {
    const double force = controller.update(1.0);
    controller.applied(force);
    course.push_back(force - 1.0);
  }
  return course;
}

}  // namespace

Trap derivative_gain_trap() {
  Trap trap;
  trap.name = "1 unit of K_d (3.6)";
  trap.fails =
      "K_d of 0.015 taken per second, as df/dt has it, puts a pole far outside the unit circle at 1 kHz";
  trap.predicts = "z² - (1 - Kp - Kd') z - Kd' = 0, stable for |Kd'| < 1, Kp + 2 Kd' < 2";
  trap.quantity = "largest pole |z|";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "derivative_gain";
  trap.plot = small_plot("(3.6): step of 1 N, Kp 0.45, K_d 0.015", {"sample at 1 kHz", ""},
                         {"|deviation from 1 N|", "N", true, 1e-12, 1e12});
  const std::vector<double> per_second = step_course(0.45, 0.015 * kRateHz, 12);
  const std::vector<double> in_ms = step_course(0.45, 0.015, 40);
  report::PlotSeries bad = published("K_d in s"), good = ours("K_d in ms");
  for (auto [series, course] : {std::pair{&bad, &per_second}, std::pair{&good, &in_ms}}) {
    for (const double d : *course)
      series->add(static_cast<double>(series->points.size()), std::max(1e-12, std::abs(d)));
  }
  trap.plot.series = {bad, good};
  trap.forms = {{"published, K_d in s", spectral_radius(per_second)},
                {"here, K_d in ms", spectral_radius(in_ms)}};
  return trap;
}

Trap integrating_loop_trap() {
  Trap trap;
  trap.name = "2 (3.6) without K_d";
  trap.fails =
      "f_d is last tick's command, so the loop sees no device: it is a first-order lag, of (1/Kp - 1) ticks, "
      "and "
      "oscillates without end from Kp = 2 on";
  trap.predicts = "f_c(k) = (1 - Kp) f_c(k-1) + Kp f~_d(k): pole 1 - Kp";
  trap.quantity = "pole |z|";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "integrating_loop";
  trap.plot = small_plot("(3.6) without K_d: step of 1 N", {"sample at 1 kHz", ""}, {"command", "N"});
  for (const double kp : {0.45, 1.05, 2.1}) {
    const std::vector<double> course = step_course(kp, 0.0, 16);
    report::PlotSeries series = kp > 2.0 ? published("Kp 2.1") : ours(kp < 1.0 ? "Kp 0.45" : "Kp 1.05");
    if (kp > 1.0 && kp < 2.0) series.color = cli::palette(4);
    for (const double d : course) series.add(static_cast<double>(series.points.size()), d + 1.0);
    trap.plot.series.push_back(series);
    trap.forms.push_back({kp > 2.0   ? "Kp 2.1: refused here"
                          : kp < 1.0 ? "here, Kp 0.45 (1.0)"
                                     : "here, Kp 1.05 (1.5 high force)",
                          spectral_radius(course)});
  }
  return trap;
}

namespace {

/// A rigid mass on an ideal spring under a controlled device, sampled at 1 kHz: mean of ten force samples,
/// command after a tick, amplifier's pole. Everything else is the controller that ships.
struct SampledLoop {
  double object_n_per_mm = 1.0;
  double damping_n_s_per_mm = 5e-4;
  double mass_kg = 0.5;
  double kp = 0.45;
  double latency_s = 1e-3;
  double amplifier_hz = 300.0;

  double tau_x() const {
    return 0.5e-3 + 1e-3 * (1.0 / kp - 1.0) + 1.0 / (2.0 * std::numbers::pi * amplifier_hz) + latency_s;
  }
  /// k~max ≈ (b + τ_f k)/τ_x.
  double bound() const { return (damping_n_s_per_mm + (tau_x() + 0.45e-3) * object_n_per_mm) / tau_x(); }

  /// Whether a small disturbance has grown after two seconds.
  bool grows(double target_n_per_mm) const {
    constexpr double kFineS = 1e-5;
    constexpr int kPerSample = 10, kPerTick = 100;
    rt::ForceController controller({rt::ControlLaw::kClosedLoop, kp, 0.0}, kRateHz);
    std::deque<double> pending(static_cast<std::size_t>(std::lround(latency_s / kFineS)), 0.0);
    const double decay = std::exp(-2.0 * std::numbers::pi * amplifier_hz * kFineS);
    double x = 1e-3, v = 0.0, device = 0.0, command = 0.0, sum = 0.0;
    double early = 0.0, late = 0.0;
    const int steps = 200'000;
    for (int i = 0; i < steps; ++i) {
      if (i % kPerSample == 0) sum += object_n_per_mm * x;
      if (i % kPerTick == kPerTick - kPerSample) {
        command = controller.update(0.1 * sum - target_n_per_mm * x);
        controller.applied(command);
        sum = 0.0;
      }
      pending.push_back(command);
      device = pending.front() + (device - pending.front()) * decay;
      pending.pop_front();
      const double force = device - object_n_per_mm * x - damping_n_s_per_mm * v;
      v += 1e3 * force / mass_kg * kFineS;
      x += v * kFineS;
      if (i < steps / 4) early = std::max(early, std::abs(x));
      if (i >= 3 * (steps / 4)) late = std::max(late, std::abs(x));
      if (!(std::abs(x) < 1.0)) return true;
    }
    return late > early;
  }
  double largest_stable() const {
    double low = 0.2 * bound(), high = 2.0 * bound();
    for (int i = 0; i < 8; ++i) {
      const double middle = 0.5 * (low + high);
      (grows(middle) ? high : low) = middle;
    }
    return 0.5 * (low + high);
  }
};

}  // namespace

Trap stability_bound_trap() {
  Trap trap;
  trap.name = "3 limit of the target in 1D";
  trap.fails =
      "\"object + wall\", k + b/τ_x, is too low, the more the stiffer the object: force is older than "
      "position, "
      "which damps";
  trap.predicts = "k~max = (b + τ_f k)/τ_x, τ_f = τ_x + 0.45 ms";
  trap.quantity = "bound over the limit simulated, object of 3 N/mm";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "stability_bound";
  trap.plot = small_plot("Bound over the limit simulated, 0.5 kg on a spring, Kp 0.45",
                         {"object", "N/mm", true}, {"bound / limit", "1"});
  report::PlotSeries wall = published("object + wall"), closed = ours("(b + τ_f k)/τ_x");
  for (report::PlotSeries* series : {&wall, &closed}) {
    series->mark = report::PlotMark::kOfColor;
  }
  for (const double k : {0.03, 0.1, 0.3, 1.0, 3.0}) {
    SampledLoop loop;
    loop.object_n_per_mm = k;
    const double limit = loop.largest_stable();
    const double of_wall = k + loop.damping_n_s_per_mm / loop.tau_x();
    wall.add(k, of_wall / limit);
    closed.add(k, loop.bound() / limit);
    if (k == 3.0) trap.forms = {{"object + wall", of_wall / limit}, {"here", loop.bound() / limit}};
  }
  trap.plot.series = {wall, closed};
  trap.plot.references = {{report::PlotReference::Axis::kY, 1.0, ""}};
  return trap;
}

}  // namespace hapticd::study::extremes
