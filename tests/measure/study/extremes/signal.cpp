#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "hal/sim/base/random.h"
#include "rt/signal/adaptive_window_velocity.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/structural_deflection.h"
#include "rt/signal/tool_load.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr double kCountMm = 0.03;  // an encoder step of the coarser device
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// What both ends of a window's line, each known to half a count, make of a velocity.
constexpr double kCountOverWindow = kCountMm * kRateHz / rt::AdaptiveWindowVelocity::kMaxWindow;

double counts(double position_mm) {
  return kCountMm * std::round(position_mm / kCountMm);
}

double velocity_at_rest(const Effort& effort) {
  rt::AdaptiveWindowVelocity velocity(kCountMm, kRateHz);
  return largest_of(effort.ticks(10.0), [&](long) { return velocity.update(123.45); });
}

double velocity_of_dither(const Effort& effort) {
  rt::AdaptiveWindowVelocity velocity(kCountMm, kRateHz);
  sim::Random random(1);
  return largest_of(effort.ticks(1.0), [&](long i) {
    const double v = velocity.update(random.uniform() < 0.5 ? 0.0 : kCountMm);
    return i > 16 ? v : 0.0;
  });
}

double velocity_after_nan(const Effort&) {
  double worst = 0.0;
  for (const auto fit : {rt::AdaptiveWindowVelocity::Fit::kEnd, rt::AdaptiveWindowVelocity::Fit::kBest}) {
    rt::AdaptiveWindowVelocity velocity(kCountMm, kRateHz, fit);
    for (int i = 0; i < 100; ++i) velocity.update(0.4 * i);
    velocity.update(kNan);
    double last = 0.0;
    for (int i = 1; i <= 200; ++i) {
      if (!(std::abs(velocity.update(0.4 * (100 + i)) - 400.0) < 1e-6)) last = i;
    }
    worst = std::max(worst, last);
  }
  return worst;
}

double velocity_through_gaps(const Effort&) {
  rt::MotionEstimator motion(kCountMm, kRateHz);
  Largest largest;
  std::int64_t time_ns = 0;
  for (int i = 0; i < 20'000; ++i) {
    time_ns += i % 37 == 0 ? 6'000'000 : 1'000'000;  // 5 ms are missing
    motion.update(counts(100e-9 * static_cast<double>(time_ns)), time_ns);
    if (i > 40) largest.see(motion.velocity_mm_per_s() - 100.0);
  }
  return largest.value();
}

double velocity_in_jitter(const Effort&) {
  rt::MotionEstimator motion(kCountMm, kRateHz);
  sim::Random random(2);
  Largest largest;
  std::int64_t time_ns = 0;
  for (int i = 0; i < 200'000; ++i) {
    time_ns += 700'000 + static_cast<std::int64_t>(600'000 * random.uniform());
    motion.update(counts(100e-9 * static_cast<double>(time_ns)), time_ns);
    if (i > 40) largest.see(motion.velocity_mm_per_s() - 100.0);
  }
  return largest.value();
}

double butterworth_noise(const Effort& effort) {
  rt::ButterworthLowPass filter(50.0, kRateHz);
  sim::Random random(3);
  // A random telegraph: ±1, held for any number of ticks; the worst input there is to a low-pass is one.
  double input = 1.0;
  return largest_of(effort.ticks(10.0), [&](long) {
    if (random.uniform() < 0.1) input = -input;
    return filter.update(input);
  });
}

/// No input within ±1 gives more.
double sum_of_impulse_response() {
  rt::ButterworthLowPass filter(50.0, kRateHz);
  double sum = std::abs(filter.update(1.0));
  for (int i = 0; i < 1000; ++i) sum += std::abs(filter.update(0.0));
  return sum * (1.0 + 1e-13);
}

double butterworth_slowest(const Effort&) {
  rt::ButterworthLowPass filter(0.01, kRateHz);
  double output = 0.0;
  for (int i = 0; i < 1'000'000; ++i) output = filter.update(1.0);
  return std::abs(output - 1.0);
}
/// Rounding of the coefficients at 0.01 Hz: ε over (ω T)², for each of the four in the gain.
const double kSlowestBound =
    4.0 * std::numeric_limits<double>::epsilon() / std::pow(2.0 * std::numbers::pi * 0.01 / kRateHz, 2);

double butterworth_fades(const Effort&) {
  rt::ButterworthLowPass filter(50.0, kRateHz);
  filter.seed(1e300);
  double output = 1.0;
  for (int i = 0; i < 20'000; ++i) output = filter.update(0.0);
  return std::abs(output);
}

double butterworth_reseeded(const Effort&) {
  rt::ButterworthLowPass filter(50.0, kRateHz);
  filter.update(kNan);
  filter.seed(2.5);
  Largest largest;
  for (int i = 0; i < 1000; ++i) largest.see(filter.update(2.5) - 2.5);
  return largest.value();
}

double deflection_ten_hours(const Effort& effort) {
  rt::StructuralDeflection deflection(3.5, 10.0, kRateHz);
  hal::Vector3 bent;
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) bent = deflection.update({3.5, 0.0, i % 2 == 0 ? 7.0 : 0.0});
  return std::abs(bent.x - 1.0);
}

double deflection_soft_and_rigid(const Effort&) {
  Largest largest;
  for (const double stiffness : {1e-4, 1.0, 1e3}) {
    rt::StructuralDeflection deflection(stiffness, 0.0, kRateHz);
    largest.see(deflection.update({1.0, 0.0, 0.0}).x * stiffness - 1.0);
  }
  rt::StructuralDeflection rigid(0.0, 10.0, kRateHz);
  largest.see(rigid.update({37.5, 0.0, 0.0}).x);
  return largest.value();
}

/// A tool in any orientation, however its quaternion is scaled, that bears nothing but its weight.
double weight_left(const Effort&) {
  sim::Random random(4);
  Largest largest;
  for (int i = 0; i < 200'000; ++i) {
    const double mass_g = std::pow(10.0, 3.0 * random.uniform());
    const rt::ToolLoad load(mass_g, {0.0, 0.0, -1.0});
    hal::RigSample sample;
    const double scale = std::pow(10.0, 6.0 * random.uniform() - 3.0);
    sample.tip_orientation = {scale * random.normal(), scale * random.normal(), scale * random.normal(),
                              scale * random.normal()};
    const hal::Quaternion q = rt::unit(sample.tip_orientation);
    const double weight_n = rt::inertial_force_n(mass_g, rt::ToolLoad::kGravityMmPerS2);
    const hal::Vector3 in_tool = rt::rotated({q.w, -q.x, -q.y, -q.z}, {0.0, 0.0, -weight_n});
    sample.sensor_force_n = in_tool - hal::Vector3{0.0, 0.0, -weight_n};
    largest.see(rt::norm(load.without_weight_n(sample)) / weight_n);
  }
  return largest.value();
}

double orientation_of_nothing(const Effort&) {
  const rt::ToolLoad load(12.59, {0.0, 0.0, -1.0});
  hal::RigSample sample;
  sample.tip_orientation = {0.0, 0.0, 0.0, 0.0};
  sample.sensor_force_n = {0.0, 0.0, 1.0};
  return std::abs(load.without_weight_n(sample).z - 1.0);
}

}  // namespace

ExtremeGroup signal_extremes() {
  return {"signal",
          "Signals: velocity, filters, tool load, deflection",
          {
              {"adaptive window", "ten hours at rest on one count", "largest velocity", "mm/s", 0.0,
               "no motion", velocity_at_rest},
              {"adaptive window", "an hour of dither between two counts", "largest velocity", "mm/s",
               kCountOverWindow * (1.0 + 1e-12), "one count over the longest window", velocity_of_dither},
              {"adaptive window", "one NaN at 400 mm/s", "ticks until right again", "1",
               rt::AdaptiveWindowVelocity::kMaxWindow + 1.0, "length of its memory", velocity_after_nan},
              {"motion estimator", "5 ms gaps at 100 mm/s", "velocity error", "mm/s",
               kCountOverWindow * (1.0 + 1e-9), "one count over the longest window", velocity_through_gaps},
              {"motion estimator", "period jitters by 30 %, 100 mm/s", "velocity error", "mm/s",
               0.3 * 100.0 + kCountMm * kRateHz, "30 % and one count a period", velocity_in_jitter},
              {"Butterworth filter", "ten hours of random ±1", "largest output", "1",
               sum_of_impulse_response(), "Σ|h|, its impulse response", butterworth_noise},
              {"Butterworth filter", "cut-off 0.01 Hz at 1 kHz", "error of the gain", "1", kSlowestBound,
               "4 ε/(ωT)²", butterworth_slowest},
              {"Butterworth filter", "input falls from 1e300 to 0", "output after 20 s", "1",
               std::numeric_limits<double>::min(), "e^(-222 t): gone", butterworth_fades},
              {"Butterworth filter", "NaN, then seeded again", "largest error afterwards", "1", 1e-14,
               "seed() settles at once", butterworth_reseeded},
              {"structural deflection", "ten hours at 3.5 N, dither of 7 N across", "drift", "mm", 1e-12,
               "f/k_s, rounding", deflection_ten_hours},
              {"structural deflection", "k_s 1e-4 … 1e3 N/mm, rigid", "error of f/k_s", "1", 1e-15,
               "closed form", deflection_soft_and_rigid},
              {"tool load", "any orientation, |q| 1e-3 … 1e3, 1 g … 1 kg", "weight left", "1", 1e-14,
               "(4.5), rounding", weight_left},
              {"tool load", "quaternion of length 0", "force error", "N", 1e-15, "counts as upright",
               orientation_of_nothing},
          }};
}

}  // namespace hapticd::study::extremes
