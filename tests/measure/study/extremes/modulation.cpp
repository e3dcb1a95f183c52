#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hal/sim/base/random.h"
#include "rt/inclusion/rendered_inclusions.h"
#include "rt/modulation/contact_transient.h"
#include "rt/modulation/friction_modulation.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr rt::TickInterval kTick{1e-3, 1.0, 1.0, false};

hal::Vector3 any_direction(sim::Random& random) {
  const hal::Vector3 v{random.normal(), random.normal(), random.normal()};
  return v * (1.0 / rt::norm(v));
}

rt::InclusionParameters inclusion_of(double exponent, rt::InclusionVariant variant) {
  rt::InclusionParameters inclusion;
  inclusion.variant = variant;
  inclusion.place_mm = {0.0, 0.0, -25.0};
  inclusion.response = {0.4, 1e-3, exponent};
  inclusion.internal_friction = variant == rt::InclusionVariant::kEnergy ? 0.15 : 0.0;
  return inclusion;
}

/// Any place, direction, depth and rate.
double inclusion_anywhere(rt::InclusionVariant variant, const Effort& effort) {
  sim::Random random(11);
  Largest largest;
  const long ticks = effort.ticks(0.1);
  for (const double exponent : {1.0, 1.5, 3.0}) {
    rt::RenderedInclusions law({inclusion_of(exponent, variant)});
    for (long i = 0; i < ticks; ++i) {
      rt::Indentation at;
      at.tip_mm = any_direction(random) * std::pow(10.0, 6.0 * random.uniform() - 3.0);
      at.normal = any_direction(random);
      at.displacement_mm = std::pow(10.0, 12.0 * random.uniform() - 9.0);
      at.rate_mm_per_s = 1e4 * (random.uniform() - 0.5);
      largest.see(std::isfinite(rt::norm(law.update(at))) ? 0.0 : kNan);
    }
  }
  return largest.value();
}

/// Straight down over it, from the surface through the sphere and out of its other side: the largest slope of
/// the force, over the larger one of the response's slope where it was identified to, and of the smooth step
/// to nothing within l_0 past the sphere, 1.5 f(l_0)/l_0.
double inclusion_past(const Effort&) {
  Largest largest;
  for (const double exponent : {1.0, 2.0}) {
    rt::InclusionParameters inclusion = inclusion_of(exponent, rt::InclusionVariant::kEnergy);
    inclusion.internal_friction = 0.0;
    rt::RenderedInclusions law({inclusion});
    constexpr double kStepMm = 0.01;
    const double l0_mm = rt::norm(inclusion.place_mm - inclusion.surface_mm);
    const double slope_n_per_mm = inclusion.response.stiffness_n_per_mm_m * exponent *
                                  std::pow(inclusion.max_displacement_mm, exponent - 1.0);
    const double end_n_per_mm = 1.5 * rt::response_at(inclusion, l0_mm).elastic_n / l0_mm;
    double before_n = 0.0;
    for (double depth_mm = kStepMm; depth_mm < 80.0; depth_mm += kStepMm) {
      const double force_n = rt::norm(law.update({{0.0, 0.0, -depth_mm}, {0.0, 0.0, 1.0}, depth_mm, 0.0}));
      largest.see((force_n - before_n) / (std::max(slope_n_per_mm, end_n_per_mm) * kStepMm));
      before_n = force_n;
    }
  }
  return largest.value();
}

/// A loop around the sphere, over and over, without internal friction: the force at its start.
double inclusion_ten_hours(const Effort& effort) {
  rt::InclusionParameters inclusion = inclusion_of(1.5, rt::InclusionVariant::kEnergy);
  inclusion.internal_friction = 0.0;
  rt::RenderedInclusions law({inclusion});
  const auto at = [](long tick) {
    const double phase = 2.0 * M_PI * static_cast<double>(tick % 1000) / 1000.0;
    const double depth_mm = 6.0 - 5.0 * std::cos(phase);
    return rt::Indentation{
        {10.0 * std::sin(phase), 5.0 * std::cos(phase), -depth_mm}, {0.0, 0.0, 1.0}, depth_mm, 0.0};
  };
  const hal::Vector3 first = law.update(at(0));
  const long ticks = effort.ticks(10.0) / 1000 * 1000;
  hal::Vector3 last;
  for (long i = 1; i <= ticks; ++i) last = law.update(at(i));
  return rt::norm(last - first);
}

double inclusion_nan(const Effort&) {
  rt::RenderedInclusions law({inclusion_of(1.5, rt::InclusionVariant::kEnergy)});
  const rt::Indentation good{{0.0, 0.0, -5.0}, {0.0, 0.0, 1.0}, 5.0, 0.0};
  const hal::Vector3 before = law.update(good);
  for (rt::Indentation bad : {rt::Indentation{{kNan, 0.0, 0.0}, {0.0, 0.0, 1.0}, 5.0, 0.0},
                              rt::Indentation{{0.0, 0.0, -5.0}, {0.0, kNan, 1.0}, 5.0, 0.0},
                              rt::Indentation{{0.0, 0.0, -5.0}, {0.0, 0.0, 1.0}, kNan, 0.0}}) {
    law.update(bad);
  }
  law.reset();
  return rt::norm(law.update(good) - before);
}

/// One way for 0.4 s, then the other.
rt::FrictionModulation::Input stroke(sim::Random& random, long tick) {
  rt::FrictionModulation::Input input;
  input.normal = {0.0, 0.0, 1.0};
  input.normal_n = input.hand_normal_n = std::pow(10.0, 8.0 * random.uniform() - 6.0);
  const double speed = std::pow(10.0, 6.0 * random.uniform() - 3.0) * (tick / 400 % 2 == 0 ? 1.0 : -1.0);
  input.friction_n = {-2.0 * (random.uniform() - 0.2) * std::copysign(input.normal_n, speed),
                      random.normal() * input.normal_n, 0.0};
  input.step_mm = {1e-3 * speed, 1e-4 * random.normal() * speed, 0.0};
  input.velocity_mm_per_s = {speed, 0.1 * random.normal() * speed, 0.0};
  input.interval = kTick;
  return input;
}

/// More friction than there is, for any stroke.
double more_friction(const Effort& effort) {
  sim::Random random(12);
  rt::FrictionModulation modulation(rt::FrictionTarget{3.0, std::nullopt}, 0.8);
  return largest_of(effort.ticks(1.0),
                    [&](long i) { return rt::norm(modulation.update(stroke(random, i))); });
}

/// Less: the share of the friction along the way that is taken away.
double less_friction(const Effort& effort) {
  sim::Random random(13);
  rt::FrictionModulation modulation(rt::FrictionTarget{0.15, std::nullopt}, 0.8);
  return largest_of(effort.ticks(1.0), [&](long i) {
    const rt::FrictionModulation::Input input = stroke(random, i);
    const double friction_n = rt::norm(input.friction_n);
    return rt::norm(modulation.update(input)) / std::max(friction_n, 1e-12);
  });
}

double friction_nan(const Effort&) {
  rt::FrictionModulation modulation(rt::FrictionTarget{2.0, std::nullopt}, 0.8);
  sim::Random random(14);
  Largest largest;
  for (int field = 0; field < 5; ++field) {
    rt::FrictionModulation::Input input = stroke(random, 0);
    (field == 0   ? input.normal.x
     : field == 1 ? input.friction_n.x
     : field == 2 ? input.normal_n
     : field == 3 ? input.step_mm.x
                  : input.velocity_mm_per_s.x) = kNan;
    largest.see(rt::norm(modulation.update(input)));
  }
  return largest.value();
}

constexpr double kRateHz = 5000.0;
constexpr double kMaxTransientN = 3.0;

rt::ContactTransient transient_of(double hz, double gain_per_s) {
  rt::TransientParameters transient;
  transient.target = {{hz, 30.0, gain_per_s}};
  transient.max_force_n = kMaxTransientN;
  return {transient, rt::grip_plant(transient.grip, 75.0, 3.5, 12.6, 0.0), 100.0, kRateHz};
}
rt::ContactTransient::Input touch(double speed_mm_per_s, bool declared, double interval_s = 1.0 / kRateHz) {
  return {true,           declared,        1.0,
          speed_mm_per_s, {0.0, 0.0, 1.0}, {interval_s, kRateHz * interval_s, 1.0, false}};
}

/// The largest gain on the fastest impact: its force, and what is left of it after 0.1 s.
double transient_peak(const Effort&) {
  Largest largest;
  for (const double hz : {10.0, 100.0, 300.0}) {
    rt::ContactTransient transient = transient_of(hz, 1000.0);
    for (int i = 0; i < 5000; ++i) largest.see(rt::norm(transient.update(touch(2000.0, i == 0))));
  }
  return largest.value();
}
double transient_end(const Effort&) {
  Largest largest;
  for (const double hz : {10.0, 100.0, 300.0}) {
    rt::ContactTransient transient = transient_of(hz, 1000.0);
    for (int i = 0; i < 5000; ++i) {
      const double force_n = rt::norm(transient.update(touch(2000.0, i == 0)));
      if (i > std::lround(0.1 * kRateHz) + 1) largest.see(force_n);
    }
  }
  return largest.value();
}
double transient_nan(const Effort&) {
  rt::ContactTransient transient = transient_of(100.0, 15.0);
  Largest largest;
  for (int i = 0; i < 500; ++i) largest.see(rt::norm(transient.update(touch(kNan, i == 0))));
  return largest.value();
}

}  // namespace

ExtremeGroup modulation_extremes() {
  const auto anywhere = [](rt::InclusionVariant variant) {
    return [variant](const Effort& effort) { return inclusion_anywhere(variant, effort); };
  };
  return {
      "modulation",
      "What is not there: inclusions, friction targets, transients",
      {
          {"inclusion, energy", "any place, direction, depth 1e-9 … 1e3 mm, rate", "0 where finite", "1", 0.0,
           "no singular point", anywhere(rt::InclusionVariant::kEnergy)},
          {"inclusion, published", "any place, direction, depth 1e-9 … 1e3 mm, rate", "0 where finite", "1",
           0.0, "held off its singular points", anywhere(rt::InclusionVariant::kPublished)},
          {"inclusion, energy", "pressed through the sphere and past it", "slope over the largest allowed",
           "1", 1.0 + 1e-6, "its own slope; past the sphere 1.5 f/l_0", inclusion_past},
          {"inclusion, energy", "ten hours of loops around it", "drift of the force", "N", 0.0,
           "a function of the place", inclusion_ten_hours},
          {"inclusion, energy", "place, normal or depth of NaN, then reset", "change of the force", "N", 0.0,
           "nothing is kept", inclusion_nan},
          {"friction target, × 3", "any load 1e-6 … 100 N, speed and friction, an hour", "largest force", "N",
           rt::FrictionModulation::kMaxAddedN * rt::FrictionModulation::kMaxLevel * (1.0 + 1e-12),
           "(s - 1) μ f_n bounded, times the largest level", more_friction},
          {"friction target, × 0.15", "any load 1e-6 … 100 N, speed and friction, an hour",
           "largest share of the friction", "1", rt::FrictionModulation::kMaxReduction * (1.0 + 1e-12),
           "never more than is there", less_friction},
          {"friction target", "an input of NaN", "force", "N", 0.0, "nothing for what is no number",
           friction_nan},
          {"transient", "the largest gain at 2 m/s, 10 … 300 Hz", "largest force", "N",
           kMaxTransientN * (1.0 + 1e-12), "max_force_n", transient_peak},
          {"transient", "the same, 0.1 s later", "largest force", "N", 0.0, "ends after 0.1 s",
           transient_end},
          {"transient", "an approach of NaN", "force", "N", 0.0, "nothing for what is no number",
           transient_nan},
      }};
}

}  // namespace hapticd::study::extremes
