#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "hal/sim/base/random.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/friction/dahl.h"
#include "rt/signal/tool_load.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/tool_load_fit.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/palpated.h"
#include "tests/reference/contact_double_stage.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Displacement error at half the depth, of a law found; an estimator that finds none is wrong by all.
double error_of(const std::optional<identification::HuntCrossleyEstimate>& found,
                const rt::HuntCrossleyParameters& truth, double deepest_mm) {
  if (!found) return 1.0;
  const double force = rt::hunt_crossley_force_n(truth, 0.5 * deepest_mm, 0.0);
  return std::abs(rt::hunt_crossley_displacement(found->parameters, force, 0.0).displacement_mm /
                      (0.5 * deepest_mm) -
                  1.0);
}

template <class Fit>
double over_the_range(const Fit& fit) {
  Largest largest;
  for (const double exponent : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    for (const double deepest : {0.1, 1.0, 10.0, 60.0}) {
      const double stiffness = 4.0 / std::pow(deepest, exponent);
      const rt::HuntCrossleyParameters law{stiffness, 1e-3 * stiffness, exponent};
      largest.see(error_of(fit(palpated(law, deepest, 20.0, 0.0, 1)), law, deepest));
    }
  }
  return largest.value();
}

double single_over_the_range(const Effort&) {
  return over_the_range([](const std::vector<identification::PalpationSample>& samples) {
    identification::SingleStageEstimator estimator;
    for (const auto& s : samples) estimator.add(s);
    return estimator.estimate();
  });
}

double projection_over_the_range(const Effort&) {
  return over_the_range([](const std::vector<identification::PalpationSample>& samples) {
    return identification::fit_by_variable_projection(samples);
  });
}

/// Two depths that differ by ever less, 3 mN of noise: what is claimed must be true at the depth it was seen
/// at, and there is no claim to anything else. Error of the force there.
template <class Fit>
double ill_conditioned(const Fit& fit) {
  const rt::HuntCrossleyParameters law{0.5, 5e-4, 1.5};
  Largest largest;
  for (double spread = 0.3; spread > 1e-9; spread *= 0.3) {
    sim::Random random(7);
    std::vector<identification::PalpationSample> samples;
    for (int i = 0; i < 20'000; ++i) {
      identification::PalpationSample s;
      s.displacement_mm = 3.0 * (1.0 + spread * std::sin(0.01 * i));
      s.rate_mm_per_s = 3.0 * spread * 10.0 * std::cos(0.01 * i);
      s.normal_force_n =
          rt::hunt_crossley_force_n(law, s.displacement_mm, s.rate_mm_per_s) + 0.003 * random.normal();
      s.in_contact = true;
      s.time_s = 1e-3 * i;
      samples.push_back(s);
    }
    const std::optional<identification::HuntCrossleyEstimate> found = fit(samples);
    if (!found) continue;
    const double truth = rt::hunt_crossley_force_n(law, 3.0, 0.0);
    largest.see(rt::hunt_crossley_force_n(found->parameters, 3.0, 0.0) / truth - 1.0);
  }
  return largest.value();
}

double single_ill_conditioned(const Effort&) {
  return ill_conditioned([](const std::vector<identification::PalpationSample>& samples) {
    identification::SingleStageEstimator estimator;
    for (const auto& s : samples) estimator.add(s);
    return estimator.estimate();
  });
}
double double_ill_conditioned(const Effort&) {
  return ill_conditioned([](const std::vector<identification::PalpationSample>& samples) {
    identification::DoubleStageEstimator estimator;
    for (const auto& s : samples) estimator.add(s);
    return estimator.estimate();
  });
}
double projection_ill_conditioned(const Effort&) {
  return ill_conditioned([](const std::vector<identification::PalpationSample>& samples) {
    return identification::fit_by_variable_projection(samples);
  });
}

/// Holds the same depth for ten hours: nothing distinguishes exponent from stiffness, and nothing may be
/// claimed.
double single_held(const Effort& effort) {
  identification::SingleStageEstimator estimator;
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) estimator.add({3.0, 0.0, 2.0, true, 1e-3 * static_cast<double>(i)});
  return estimator.estimate().has_value() ? 1.0 : 0.0;
}

/// Samples with NaN in every field in turn, among good ones: the same estimate as without them.
template <class Estimator>
double with_nan() {
  const rt::HuntCrossleyParameters law{0.5, 5e-4, 1.5};
  Estimator clean, dirty;
  int i = 0;
  for (const identification::PalpationSample& s : palpated(law, 3.0, 20.0, 0.003, 3)) {
    clean.add(s);
    dirty.add(s);
    if (++i % 40 != 0) continue;  // between two means of four
    for (int field = 0; field < 3; ++field) {
      identification::PalpationSample bad = s;
      (field == 0 ? bad.displacement_mm : field == 1 ? bad.rate_mm_per_s : bad.normal_force_n) = kNan;
      for (int n = 0; n < 4; ++n) dirty.add(bad);
    }
  }
  const auto a = clean.estimate(), b = dirty.estimate();
  if (!a || !b) return kNan;
  return std::abs(b->parameters.stiffness_n_per_mm_m / a->parameters.stiffness_n_per_mm_m - 1.0) +
         std::abs(b->parameters.exponent - a->parameters.exponent);
}

double projection_with_nan(const Effort&) {
  const rt::HuntCrossleyParameters law{0.5, 5e-4, 1.5};
  std::vector<identification::PalpationSample> samples = palpated(law, 3.0, 20.0, 0.0, 3);
  for (std::size_t i = 0; i < samples.size(); i += 100) samples[i].rate_mm_per_s = kNan;
  for (std::size_t i = 50; i < samples.size(); i += 100) samples[i].normal_force_n = kNan;
  return error_of(identification::fit_by_variable_projection(samples), law, 3.0);
}

/// Creep law of a palpation that holds one force only, or is noise: claimed displacement at that force.
double creep_of_one_force(const Effort&) {
  identification::CreepFit fit(identification::creep_times_s(1e-3));
  for (int i = 0; i < 60'000; ++i) fit.add({3.0, 0.0, 2.0, true, 1e-3 * i}, 1e-3);
  const std::optional<identification::CreepEstimate> found = fit.solve();
  if (!found) return 0.0;
  rt::CreepLaw law(found->law.parameters, 1000.0);
  rt::LawEstimate now;
  for (int i = 0; i < 60'000; ++i) now = law.update(2.0);
  return std::abs(now.displacement_mm / 3.0 - 1.0);
}

double creep_with_nan(const Effort&) {
  const rt::HuntCrossleyParameters law{0.5, 0.0, 1.5};
  identification::CreepFit fit(identification::creep_times_s(1e-3));
  int i = 0;
  for (identification::PalpationSample s : palpated(law, 3.0, 20.0, 0.0, 3)) {
    if (++i % 1000 == 0) s.normal_force_n = kNan;
    if (i % 1000 == 500) s.displacement_mm = kNan;
    fit.add(s, 1e-3);
  }
  const std::optional<identification::CreepEstimate> found = fit.solve();
  if (!found) return 1.0;
  return std::abs(rt::CreepLaw(found->law.parameters, 1000.0).curve(1.0).displacement_mm /
                      rt::hunt_crossley_displacement(law, 1.0, 0.0).displacement_mm -
                  1.0);
}

// -- the tool

identification::ToolExcitation held_tool(const hal::Vector3& turn_rad, sim::Random& random, double noise_n) {
  const double angle = rt::norm(turn_rad);
  const double s = angle > 0.0 ? std::sin(0.5 * angle) / angle : 0.0;
  const hal::Quaternion q{std::cos(0.5 * angle), -turn_rad.x * s, -turn_rad.y * s, -turn_rad.z * s};
  identification::ToolExcitation e;
  e.gravity_in_tool = rt::rotated(q, {0.0, 0.0, -1.0});
  e.weight_n_per_g = e.gravity_in_tool * (1e-6 * rt::ToolLoad::kGravityMmPerS2);
  e.force_n = e.weight_n_per_g * 12.59 + hal::Vector3{0.1, -0.2, 0.3} +
              hal::Vector3{noise_n * random.normal(), noise_n * random.normal(), noise_n * random.normal()};
  return e;
}

/// One posture for ten hours: nothing distinguishes mass from bias. How sure of the mass the fit is, its
/// error over what it says of it.
double tool_in_one_posture(const Effort& effort) {
  sim::Random random(5);
  identification::ToolMoments moments;
  const long ticks = effort.ticks(1.0);
  for (long i = 0; i < ticks; ++i) moments.add(held_tool({0.2, 0.1, 0.0}, random, 0.002));
  const identification::ToolLoadFit fit = identification::fit_tool_load(moments);
  if (!fit.good || !std::isfinite(fit.mass_error_g)) return 0.0;
  return std::abs(fit.mass_g - 12.59) / fit.mass_error_g;
}

/// Ten hours of sums of a tool that turns: error of the mass.
double tool_sums_of_ten_hours(const Effort& effort) {
  sim::Random random(6);
  identification::ToolMoments moments;
  const long ticks = effort.ticks(2.0);
  for (long i = 0; i < ticks; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    moments.add(held_tool({0.7 * std::sin(0.3 * t), 0.7 * std::cos(0.17 * t), 0.0}, random, 0.0));
  }
  identification::ToolMoments all;
  for (int i = 0; i < 5; ++i) all.add(moments);  // the same again, five times
  const identification::ToolLoadFit fit = identification::fit_tool_load(all);
  return fit.good ? std::abs(fit.mass_g / 12.59 - 1.0) : kNan;
}

double tool_with_nan(const Effort&) {
  sim::Random random(6);
  identification::ToolMoments moments;
  for (int i = 0; i < 100; ++i) moments.add(held_tool({0.01 * i, 0.0, 0.0}, random, 0.0));
  identification::ToolExcitation bad = held_tool({}, random, 0.0);
  bad.force_n.y = kNan;
  moments.add(bad);
  return identification::fit_tool_load(moments).good ? 1.0 : 0.0;
}

// -- friction

/// Strokes of 20 mm back and forth under this load and speed.
std::vector<identification::FrictionRow> strokes(const rt::FrictionParameters& friction, double normal_n,
                                                 const std::vector<double>& speeds_mm_per_s) {
  std::vector<identification::FrictionRow> rows;
  double z = 0.0;
  int passage = 0;
  for (const double speed : speeds_mm_per_s) {
    for (int back = 0; back < 2; ++back, ++passage) {
      double way = 0.0;
      const double heading = back == 0 ? 1.0 : -1.0;
      for (double along = 0.0; along < 20.0; along += 1e-3 * speed) {
        identification::FrictionRow row;
        row.slide_mm = heading * 1e-3 * speed;
        way += 1e-3 * speed;
        z = rt::dahl_step(z, row.slide_mm, friction.presliding_mm, friction.exponent);
        row.path_mm = way;
        row.speed_mm_per_s = heading * speed;
        row.normal_n = normal_n;
        row.friction_n = friction.kinetic * normal_n * z + friction.viscous_n_s_per_mm * heading * speed;
        row.along_mm = heading > 0.0 ? along : 20.0 - along;
        row.passage = passage;
        row.heading = back == 0 ? 1 : -1;
        row.settled = passage > 0 || way > 3.0;
        rows.push_back(row);
      }
    }
  }
  return rows;
}

double friction_of_light_touch(const Effort&) {
  const rt::FrictionParameters truth{0.3, 0.1, 1e-4};
  Largest largest;
  for (const double normal_n : {1e-6, 1e-3, 1.0, 35.0}) {
    rt::FrictionParameters scaled = truth;
    scaled.viscous_n_s_per_mm *= normal_n;
    const auto fit =
        identification::fit_friction_law(strokes(scaled, normal_n, {20.0, 60.0, 120.0, 40.0}), {});
    largest.see(fit ? fit->parameters.kinetic / truth.kinetic - 1.0 : 1.0);
  }
  return largest.value();
}

double friction_of_one_speed(const Effort&) {
  const auto fit =
      identification::fit_friction_law(strokes({0.3, 0.1, 1e-3}, 1.0, {50.0, 50.0, 50.0, 50.0}), {});
  if (!fit) return 0.0;
  // Nothing reported viscosity: it must not be called reported, and the sum of both must still be right.
  const double sum = fit->parameters.kinetic + 50.0 * fit->parameters.viscous_n_s_per_mm;
  return fit->viscous_is_identified ? 1.0 : std::abs(sum / 0.35 - 1.0);
}

double friction_without_load(const Effort&) {
  std::vector<identification::FrictionRow> rows = strokes({0.3, 0.1, 0.0}, 1.0, {50.0, 100.0});
  for (identification::FrictionRow& row : rows) row.normal_n = row.friction_n = 0.0;
  const auto fit = identification::fit_friction_law(rows, {});
  return fit && !(std::isfinite(fit->parameters.kinetic) && std::isfinite(fit->parameters.presliding_mm))
             ? kNan
             : 0.0;
}

}  // namespace

ExtremeGroup identify_extremes() {
  // |B/K·ẋ| < 0.1 is taken: ln(1 + r) ≈ r is off by r²/2, half a per cent of force.
  constexpr double kLinearised = 0.005;
  return {"identify",
          "Identification: ill-conditioned and endless data",
          {
              {"recursive single stage", "m 1 … 3, 4 N at 0.1 … 60 mm (K 2e-5 … 4e3)", "displacement error",
               "1", kLinearised, "linearisation r²/2, r < 0.1", single_over_the_range},
              {"variable projection", "m 1 … 3, 4 N at 0.1 … 60 mm (K 2e-5 … 4e3)", "displacement error", "1",
               1e-4, "search of m to 1e-5", projection_over_the_range},
              {"recursive single stage", "depth varies by 30 % … 1e-9, 3 mN noise", "force error where seen",
               "1", kLinearised, "as above; else no claim", single_ill_conditioned},
              {"recursive double stage", "depth varies by 30 % … 1e-9, 3 mN noise", "force error where seen",
               "1", kLinearised, "as above; else no claim", double_ill_conditioned},
              {"variable projection", "depth varies by 30 % … 1e-9, 3 mN noise", "force error where seen",
               "1", kLinearised, "as above; else no claim", projection_ill_conditioned},
              {"recursive single stage", "one depth for ten hours", "laws claimed", "1", 0.0,
               "nothing distinguishes m from K", single_held},
              {"recursive single stage", "NaN in every field, now and then", "change of K and m", "1", 1e-3,
               "left out with its mean of four",
               [](const Effort&) { return with_nan<identification::SingleStageEstimator>(); }},
              {"recursive double stage", "NaN in every field, now and then", "change of K and m", "1", 0.0,
               "left out", [](const Effort&) { return with_nan<identification::DoubleStageEstimator>(); }},
              {"variable projection", "NaN in 2 % of the samples", "displacement error", "1", 1e-4,
               "left out", projection_with_nan},
              {"creep fit", "one force for a minute", "displacement error there", "1", 0.01,
               "true where seen, or no claim", creep_of_one_force},
              {"creep fit", "NaN in 0.2 % of the samples", "displacement error", "1", 0.05, "left out; knots",
               creep_with_nan},
              {"tool load fit", "one posture for an hour", "error of the mass over its standard error", "1",
               5.0, "five sigma, or no claim", tool_in_one_posture},
              {"tool load fit", "sums of ten hours", "error of the mass", "1", 1e-6, "√(36e6 ε) … 36e6 ε",
               tool_sums_of_ten_hours},
              {"tool load fit", "one NaN", "called good", "1", 0.0, "says that it is not", tool_with_nan},
              {"friction fit", "loads 1 µN … 35 N", "error of μ_k", "1", 0.01,
               "load-scaled: the same at any load", friction_of_light_touch},
              {"friction fit", "one speed only", "viscosity reported, or error of the sum", "1", 0.01,
               "sum is reported, shares are not", friction_of_one_speed},
              {"friction fit", "f_n = 0 throughout", "not finite", "1", 0.0, "refused, or finite",
               friction_without_load},
          }};
}

}  // namespace hapticd::study::extremes
