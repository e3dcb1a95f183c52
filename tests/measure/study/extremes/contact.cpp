#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "hal/sim/base/random.h"
#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/tool_compensation.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr double kToolG = 9.35;
constexpr double kThresholdN = 0.015;
constexpr double kCountMm = 0.03;
constexpr double kNoiseN =
    0.002;  // of a tick's mean, as the sensor's data sheet and the dissertation have it

/// Shaken with 1 N at 5 Hz, as D§3.2.2 shakes the device: amplitude of a 75 g arm with its tool.
constexpr double kShakeHz = 5.0;
const double kOmega = 2.0 * std::numbers::pi * kShakeHz;
const double kAmplitudeMm = 1e6 / (75.0 + kToolG + 9.0) / (kOmega * kOmega);

/// What a sensor under the tool reads in that motion: the mean of m a since the tick before.
double shaken_force_n(double from_s, double to_s) {
  const auto velocity = [](double t) { return kAmplitudeMm * kOmega * std::cos(kOmega * t); };
  return rt::inertial_force_n(kToolG, (velocity(to_s) - velocity(from_s)) / (to_s - from_s));
}
double shaken_mm(double t) {
  return kAmplitudeMm * std::sin(kOmega * t);
}

double shaken(const Effort& effort) {
  rt::FreeMotionResidual residual(kToolG, kRateHz);
  sim::Random random(1);
  Largest largest;
  const long ticks = effort.ticks(1.0);
  for (long i = 1; i <= ticks; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    const double r = residual.update(shaken_force_n(t - 1e-3, t) + kNoiseN * random.normal(), shaken_mm(t),
                                     i * 1'000'000, false);
    if (i > 1000) largest.see(r);
  }
  return largest.value();
}

double shaken_with_gaps(const Effort& effort) {
  rt::FreeMotionResidual residual(kToolG, kRateHz);
  std::int64_t time_ns = 0;
  return largest_of(effort.ticks(1.0), [&](long i) {
    const std::int64_t step_ns = i % 371 == 370 ? 6'000'000 : 1'000'000;
    time_ns += step_ns;
    const double t = 1e-9 * static_cast<double>(time_ns);
    // A driver's mean is of all that arrived since the tick before.
    const double r = residual.update(shaken_force_n(t - 1e-9 * static_cast<double>(step_ns), t), shaken_mm(t),
                                     time_ns, false);
    return i > 1000 ? r : 0.0;
  });
}

/// Encoders at rest between two counts, each tick either, and the sensor's own noise.
double noisy_rest(const Effort& effort) {
  rt::FreeMotionResidual residual(kToolG, kRateHz);
  sim::Random random(2);
  double position = 0.0;
  return largest_of(effort.ticks(10.0), [&](long i) {
    if (random.uniform() < 0.01) position = kCountMm - position;
    const double r = residual.update(kNoiseN * random.normal(), position, i * 1'000'000, false);
    return i > 1000 ? r : 0.0;
  });
}

double two_reads_at_once(const Effort&) {
  rt::FreeMotionResidual residual(kToolG, kRateHz);
  Largest largest;
  for (int i = 0; i < 100'000; ++i) {
    // Two samples a microsecond apart, the encoder a count on: 3e10 mm/s² if it were taken for motion.
    residual.update(0.0, i % 2 == 0 ? 0.0 : kCountMm, (i / 2) * 1'000'000LL + (i % 2) * 1000, false);
    largest.see(residual.residual_n());
  }
  return largest.value();
}

double residual_after_nan(const Effort&) {
  rt::FreeMotionResidual residual(kToolG, kRateHz);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 100; ++i) residual.update(0.0, 0.0, i * 1'000'000, false);
  residual.update(nan, nan, 100'000'000, false);
  residual.reset();
  Largest largest;
  for (int i = 101; i < 2000; ++i) largest.see(residual.update(0.0, 0.0, i * 1'000'000, false));
  return largest.value();
}

double onset_without_quiet(const Effort&) {
  // Nothing in memory is quiet: then the oldest place is taken, 32 ticks back at 10 mm/s.
  rt::ContactOnset onset(kRateHz);
  for (int i = 0; i < 1000; ++i) onset.remember(0.01 * i, 1.0);
  return std::abs(onset.place_mm(0.01) - 0.01 * 999);
}

/// Ticks between the first force above the threshold and the declaration, after so long in free air that
/// 32-bit counters have come round.
double contact_after_49_days(const Effort& effort) {
  rt::ContactDetector detector(rt::ContactParameters{}, kRateHz);
  const auto ticks = static_cast<std::int64_t>(effort.quick ? 42'949'672 : 4'294'967'296);
  for (std::int64_t i = 0; i < ticks; ++i) detector.update(0.001, -1.0, 0.0);
  for (int delay = 0; delay < 1000; ++delay) {
    if (detector.update(0.1, 0.0, 0.0)) return delay;
  }
  return 1000.0;
}

double at_threshold(const Effort& effort) {
  rt::ContactDetector detector(rt::ContactParameters{}, kRateHz);
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) detector.update(i % 2 == 0 ? kThresholdN : -kThresholdN, 0.0, 0.0);
  return detector.count();
}

double released(const Effort&) {
  rt::ContactParameters parameters;
  rt::ContactDetector detector(parameters, kRateHz);
  for (int i = 0; i < 100; ++i) detector.update(0.0, 0.0, 0.0);
  detector.update(1.0, 0.0, 0.0);
  double force = 1.0;
  int below = 0;
  for (int i = 0; i < 100'000; ++i) {
    force *= 0.99;
    if (force < parameters.release_ratio * parameters.threshold_n) ++below;
    if (!detector.update(force, 5.0, 0.0)) return below;
  }
  return 1e5;
}

}  // namespace

ExtremeGroup contact_extremes() {
  return {"contact",
          "Contact: what inertia cannot explain, detection, onset",
          {
              {"free-motion residual", "shaken by 1 N at 5 Hz for an hour, 2 mN noise", "largest residual",
               "N", kThresholdN, "threshold: no false alarm", shaken},
              {"free-motion residual", "the same with 5 ms gaps, no noise", "largest residual", "N",
               kThresholdN, "threshold: no false alarm", shaken_with_gaps},
              {"free-motion residual", "ten hours at rest, a count back and forth every 0.1 s, 2 mN noise",
               "largest residual", "N", kThresholdN, "threshold: no false alarm", noisy_rest},
              {"free-motion residual", "two samples within 1 µs, a count apart", "largest residual", "N",
               kThresholdN, "threshold: no false alarm", two_reads_at_once},
              {"free-motion residual", "NaN, then reset", "largest residual afterwards", "N", 0.0,
               "reset() starts again", residual_after_nan},
              {"contact onset", "no quiet tick in memory, 10 mm/s", "place from the last", "mm", 0.31 + 1e-12,
               "32 ticks of memory", onset_without_quiet},
              {"contact detector", "49.7 days in free air: 32-bit counters come round",
               "delay of the next contact", "ticks", 0.0, "as on the first day", contact_after_49_days},
              {"contact detector", "ten hours exactly at ± the threshold", "contacts declared", "1", 0.0,
               "contact is beyond it", at_threshold},
              {"contact detector", "f → 0 while the tip is deep", "ticks below the release level", "ticks",
               rt::ContactParameters{}.release_time_ms, "its release_time_ms", released},
          }};
}

}  // namespace hapticd::study::extremes
