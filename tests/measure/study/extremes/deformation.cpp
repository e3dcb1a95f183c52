#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/sim/base/random.h"
#include "rt/baseline/published_direction.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/deformation/tracked_direction.h"
#include "rt/friction/dahl.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr double kCountMm = 0.03;
constexpr double kNoiseN = 0.003;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr hal::Vector3 kUp{0.0, 0.0, 1.0};
constexpr rt::FrictionParameters kRod{0.3, 0.3, 0.0};

double angle_rad(const hal::Vector3& a, const hal::Vector3& b) {
  return std::atan2(rt::norm(rt::cross(a, b)), dot(a, b));
}

// -- laws

template <class Visit>
void for_all_laws(const Visit& visit) {
  for (const double exponent : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    for (const double stiffness : {1e-4, 1e-2, 1.0, 30.0, 1e3}) {
      visit(rt::HuntCrossleyParameters{stiffness, 0.05 * stiffness, exponent});
    }
  }
}

double inverse_round_trip(const Effort&) {
  Largest largest;
  for_all_laws([&](const rt::HuntCrossleyParameters& law) {
    for (double force = 1e-3; force < 36.0; force *= 1.3) {
      for (const double rate : {-15.0, 0.0, 400.0}) {
        const double x = rt::hunt_crossley_displacement(law, force, rate).displacement_mm;
        largest.see(rt::hunt_crossley_force_n(law, x, rate) / force - 1.0);
      }
    }
  });
  return largest.value();
}

/// Inverse below 1 mN goes straight to zero: never more than the law itself gives at 1 mN, and rising.
double inverse_at_nothing(const Effort&) {
  Largest largest;
  for_all_laws([&](const rt::HuntCrossleyParameters& law) {
    const rt::LawEstimate least = rt::hunt_crossley_displacement(law, 1e-3, 0.0);
    double before = 0.0;
    for (const double force : {-1.0, 0.0, 1e-300, 1e-30, 1e-9, 1e-6, 9.99e-4}) {
      const rt::LawEstimate now = rt::hunt_crossley_displacement(law, force, 0.0);
      largest.see(now.displacement_mm < before ? 2.0 : now.displacement_mm / least.displacement_mm);
      largest.see(now.mm_per_n / least.mm_per_n);
      before = now.displacement_mm;
    }
  });
  return largest.value();
}

double inverse_withdrawn(const Effort&) {
  Largest largest;
  for_all_laws([&](const rt::HuntCrossleyParameters& law) {
    for (const double rate : {-20.0, -1e3, -1e9}) {
      const double most = std::pow(2.0 / (0.2 * law.stiffness_n_per_mm_m), 1.0 / law.exponent);
      largest.see(rt::hunt_crossley_displacement(law, 2.0, rate).displacement_mm / most);
    }
  });
  return largest.value();
}

double inverse_nan(const Effort&) {
  return std::abs(rt::hunt_crossley_displacement({1.0, 0.0, 2.0}, std::nan(""), 0.0).displacement_mm);
}

rt::CreepParameters creep_of(double stiffness_n_per_mm, double exponent) {
  rt::CreepParameters creep;
  creep.weight = {0.5, 0.2, 0.1, 0.1, 0.1};
  creep.max_force_n = 8.0;
  for (std::size_t j = 0; j < rt::CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (rt::CreepParameters::kKnots - 1);
    creep.displacement_mm[j] =
        std::pow(creep.max_force_n * share * share / stiffness_n_per_mm, 1.0 / exponent);
  }
  return creep;
}

/// Creep over Ψ of the largest force so far: whatever the past was, the law does not leave it.
double creep_within_past(const Effort& effort) {
  Largest largest;
  for (const double stiffness : {1e-4, 1.0, 1e3}) {
    for (const double exponent : {1.0, 3.0}) {
      rt::CreepLaw law(creep_of(stiffness, exponent), kRateHz);
      sim::Random random(1);
      double most = 0.0;
      const long ticks = effort.ticks(0.2);
      double force = 0.0;
      for (long i = 0; i < ticks; ++i) {
        if (random.uniform() < 0.05)
          force = 35.0 * std::pow(random.uniform(), 8.0) * (random.uniform() - 0.1);
        most = std::max(most, force);
        const double x = law.update(force).displacement_mm;
        if (most > 0.0) largest.see(x / law.curve(most).displacement_mm);
      }
    }
  }
  return largest.value();
}

double creep_ten_hours(const Effort& effort) {
  rt::CreepLaw law(creep_of(0.4, 1.5), kRateHz);
  rt::LawEstimate now;
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) now = law.update(1.6);
  // A hundredth of it is still 72 retardation times of the slowest lag.
  return std::abs(now.displacement_mm / law.curve(1.6).displacement_mm - 1.0);
}

// -- displacement

double fused_ten_hours(const Effort& effort) {
  rt::FusedDisplacement fused(0.05, kNoiseN, kRateHz);
  fused.begin(4.0, 0.03);
  return largest_of(effort.ticks(10.0), [&](long i) {
    fused.update(i % 2 == 0 ? kCountMm : -kCountMm, 0.0, {4.05, 2.0});
    return fused.displacement_mm() - 4.025;
  });
}

/// Law and way of absurd sizes, in turn: the estimate lies between where the way took it and what the law
/// says, and its variance stays one.
double fused_absurd(const Effort& effort) {
  sim::Random random(2);
  rt::FusedDisplacement fused(0.05, kNoiseN, kRateHz);
  fused.begin(1.0, 0.1);
  Largest outside;
  const long ticks = effort.ticks(0.3);
  const auto any = [&] { return std::pow(10.0, 18.0 * random.uniform() - 12.0); };
  for (long i = 0; i < ticks; ++i) {
    const double way = (random.uniform() < 0.5 ? -1.0 : 1.0) * any();
    const double there = fused.displacement_mm() + way;
    const rt::LawEstimate law{any(), any()};
    fused.update(way, any(), law);
    const double low = std::max(0.0, std::min(there, law.displacement_mm));
    const double high = std::max(there, law.displacement_mm);
    const double x = fused.displacement_mm();
    outside.see(std::max({0.0, low - x, x - high}) / high);
    if (!(fused.deviation_mm() >= 0.0)) return std::nan("");
  }
  return outside.value();
}

// -- directions

double tracked_ten_hours(const Effort& effort) {
  rt::TrackedDirection direction(kRod, kNoiseN, kRateHz);
  direction.begin(kUp);
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) direction.update(kUp, {}, {});
  return std::isfinite(direction.deviation_rad()) ? angle_rad(direction.normal(), kUp) : std::nan("");
}

double tracked_dither(const Effort& effort) {
  rt::TrackedDirection direction(kRod, kNoiseN, kRateHz);
  sim::Random random(3);
  direction.begin(kUp);
  Largest largest;
  hal::Vector3 off;
  const long ticks = effort.ticks(1.0);
  for (long i = 0; i < ticks; ++i) {
    hal::Vector3 step;
    for (auto [at, by] : {std::pair{&off.x, &step.x}, {&off.y, &step.y}, {&off.z, &step.z}}) {
      if (random.uniform() > 0.1) continue;
      *by = kCountMm - 2.0 * *at;
      *at += *by;
    }
    const hal::Vector3 noise{kNoiseN * random.normal(), kNoiseN * random.normal(), kNoiseN * random.normal()};
    direction.update(kUp + noise, step, {});
    largest.see(angle_rad(direction.normal(), kUp));
  }
  return largest.value() / kRadPerDeg;
}

/// Forces from 1e-12 N to 35 N in any direction, steps up to a metre: u^n stays a unit vector.
template <class Make>
double stays_a_unit(const Effort& effort, const Make& make) {
  auto direction = make();
  sim::Random random(4);
  Largest largest;
  const auto any = [&](double least, double most) {
    const double size = least * std::pow(most / least, random.uniform());
    return hal::Vector3{size * random.normal(), size * random.normal(), size * random.normal()};
  };
  direction.begin({});
  const long ticks = effort.ticks(0.3);
  for (long i = 0; i < ticks; ++i) {
    if (i % 100 == 0) direction.begin(any(1e-12, 35.0));
    const hal::Vector3 step = random.uniform() < 0.2 ? hal::Vector3{} : any(1e-9, 1e3);
    direction.update(any(1e-12, 35.0), step, step * kRateHz);
    largest.see(rt::norm(direction.normal()) - 1.0);
    largest.see(0.0 * rt::norm(direction.friction_n()));  // finite
  }
  return largest.value();
}

/// Angle to the true normal 30 mm after an edge of 90°, the friction of the new side fully built up.
double after_ridge(const Effort&) {
  rt::TrackedDirection direction(kRod, kNoiseN, kRateHz);
  hal::Vector3 z;
  direction.begin(kUp);
  const auto slide = [&](const hal::Vector3& step, const hal::Vector3& normal, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      z = rt::across(rt::dahl_step(z, step, kRod.presliding_mm), normal);
      direction.update((normal - z * kRod.kinetic) * 1.6, step, step * kRateHz);
    }
  };
  slide({kCountMm, 0.0, 0.0}, kUp, 500);
  slide({0.0, 0.0, -kCountMm}, {1.0, 0.0, 0.0}, 1000);
  return angle_rad(direction.normal(), {1.0, 0.0, 0.0}) / kRadPerDeg;
}

double after_reversal(const Effort&) {
  rt::TrackedDirection direction(kRod, kNoiseN, kRateHz);
  direction.begin(kUp);
  for (int i = 0; i < 5000; ++i)
    direction.update(kUp * ((i / 50) % 2 == 0 ? -1.6 : 1.6), {0.01, 0.0, 0.0}, {10.0, 0.0, 0.0});
  direction.begin(kUp);
  return angle_rad(direction.normal(), kUp);
}

/// A gel: the tip sticks while the pull grows to 0.9 f_n, then jumps by a millimetre.
double stick_slip(const Effort& effort) {
  rt::TrackedDirection direction(kRod, kNoiseN, kRateHz);
  direction.begin(kUp * 1.6);
  double sum = 0.0;
  const long ticks = effort.ticks(0.1);
  for (long i = 0; i < ticks; ++i) {
    const long phase = i % 60;
    const double step = phase >= 55 ? 0.2 : 0.0;
    const double pull =
        phase < 55 ? 0.9 * static_cast<double>(phase) / 55.0 : 0.9 * static_cast<double>(60 - phase) / 5.0;
    direction.update({-1.6 * pull, 0.0, 1.6}, {step, 0.0, 0.0}, {step * kRateHz, 0.0, 0.0});
    sum += angle_rad(direction.normal(), kUp);
  }
  return sum / static_cast<double>(ticks) / kRadPerDeg;
}

}  // namespace

ExtremeGroup deformation_extremes() {
  const double friction_angle_deg = std::atan(kRod.kinetic) / kRadPerDeg;
  return {
      "deformation",
      "Deformation: contact laws, displacement, direction",
      {
          {"inverse Hunt-Crossley", "m 1 … 3, K 1e-4 … 1e3, 1 mN … 35 N", "force of its displacement, error",
           "1", 1e-13, "(4.22) of (4.23), rounding", inverse_round_trip},
          {"inverse Hunt-Crossley", "f → 0", "displacement, slope over those at 1 mN", "1", 1.0,
           "straight to zero below 1 mN", inverse_at_nothing},
          {"inverse Hunt-Crossley", "withdrawn at 20 … 1e9 mm/s", "displacement over the largest allowed",
           "1", 1.0 + 1e-14, "rate counts as 0.8 K/B at most", inverse_withdrawn},
          {"inverse Hunt-Crossley", "force NaN", "displacement", "mm", 0.0, "counts as none", inverse_nan},
          {"creep law", "jumps of 0 … 35 N, K 1e-4 … 1e3, m 1 … 3", "displacement over Ψ(largest past force)",
           "1", 1.0 + 1e-12, "a weighted mean of the past", creep_within_past},
          {"creep law", "ten hours at 1.6 N", "error", "1", 5000.0 * std::numeric_limits<double>::epsilon(),
           "Ψ(f); a lag stalls ε τ/T before it", creep_ten_hours},
          {"fused displacement", "ten hours of dither, the law 0.05 mm off", "from the middle", "mm",
           0.025 + kCountMm, "between way and law", fused_ten_hours},
          {"fused displacement", "ways, slides, laws of 1e-12 … 1e6 mm", "outside of way and law", "1", 1e-12,
           "gain in (0, 1)", fused_absurd},
          {"tracked direction", "ten hours at rest", "turn of the normal", "rad", 1e-12, "nothing moves",
           tracked_ten_hours},
          {"tracked direction", "an hour of dither on all axes, 3 mN noise", "largest angle", "°",
           friction_angle_deg, "friction angle", tracked_dither},
          {"tracked direction", "reactions 1e-12 … 35 N, steps to 1 m", "length of the normal", "1", 1e-12,
           "a unit vector",
           [](const Effort& e) {
             return stays_a_unit(e, [] { return rt::TrackedDirection(kRod, kNoiseN, kRateHz); });
           }},
          {"published direction", "reactions 1e-12 … 35 N, steps to 1 m", "length of the normal", "1", 1e-12,
           "a unit vector",
           [](const Effort& e) {
             return stays_a_unit(
                 e, [] { return rt::PublishedDirection(rt::FrictionLaw::kDahl, kRod, kRateHz); });
           }},
          {"tracked direction", "a ridge of 90°", "angle 30 mm later", "°", friction_angle_deg,
           "friction angle", after_ridge},
          {"tracked direction", "reaction reversed every 50 ms, then a new contact", "angle", "rad", 1e-12,
           "a contact starts again", after_reversal},
          {"tracked direction", "stick-slip, pull up to 0.9 f_n", "mean angle", "°",
           std::atan(0.9) / kRadPerDeg, "no more than the reaction leans", stick_slip},
      }};
}

}  // namespace hapticd::study::extremes
