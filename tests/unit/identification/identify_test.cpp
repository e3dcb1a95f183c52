#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "contact_synthetic.h"
#include "tests/reference/contact_fit.h"
#include "tests/reference/friction_fit.h"
#include "tests/unit/rt/deformation/directions.h"
#include "tests/unit/rt/deformation/stroked_surface.h"

namespace hapticd::identification {
namespace {

using namespace rt::test;

struct Tap {
  double depth_mm, hz, seconds;
};

/// Presses of several depths and speeds, with pauses, on whatever `force_n(x, rate)` is.
template <class Force>
std::vector<PalpationSample> palpate(const Force& force_n, const std::vector<Tap>& taps, double noise_n,
                                     double step_mm) {
  std::mt19937_64 random(60);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<PalpationSample> samples;
  for (const Tap& tap : taps) {
    const double omega = 2.0 * std::numbers::pi * tap.hz;
    for (int i = 0; i < static_cast<int>(1000.0 * tap.seconds); ++i) {
      const double t = 1e-3 * i;
      const double x = 0.5 * tap.depth_mm * (1.0 - std::cos(omega * t)) - 0.3;
      const double rate = 0.5 * tap.depth_mm * omega * std::sin(omega * t);
      const double force = force_n(x, rate);
      PalpationSample s;
      s.in_contact = force > 0.0;
      s.normal_force_n = force + noise_n * noise(random);
      s.displacement_mm = step_mm > 0.0 ? step_mm * std::round(x / step_mm) : x;
      s.rate_mm_per_s = rate;
      samples.push_back(s);
    }
  }
  return samples;
}

TEST(Identify, FindsAHuntCrossleyLawUnderNoiseAndQuantisation) {
  struct Case {
    rt::HuntCrossleyParameters law;
    double depth_mm;
  };
  for (const Case& c : {Case{{0.0059, 1e-5, 2.1}, 18.0}, Case{{0.3, 1e-4, 1.3}, 6.0},
                        Case{{2.0, 1e-3, 1.5}, 2.0}, Case{{0.5, 0.0, 1.0}, 5.0}}) {
    const auto palpation =
        palpate([&](double x, double rate) { return rt::hunt_crossley_force_n(c.law, x, rate); },
                {{c.depth_mm, 0.3, 7.0}, {0.6 * c.depth_mm, 1.0, 4.0}, {c.depth_mm, 0.7, 6.0}}, 0.010, 0.03);
    const auto fit = fit_hunt_crossley(palpation);
    ASSERT_TRUE(fit) << fit.error().text();
    const rt::HuntCrossleyParameters& found = fit->parameters;
    EXPECT_NEAR(found.exponent, c.law.exponent, 0.04) << "m " << c.law.exponent;
    EXPECT_NEAR(found.stiffness_n_per_mm_m / c.law.stiffness_n_per_mm_m, 1.0, 0.10) << "m " << c.law.exponent;
    EXPECT_NEAR(found.damping_n_s_per_mm_m1 / found.stiffness_n_per_mm_m,
                c.law.damping_n_s_per_mm_m1 / c.law.stiffness_n_per_mm_m, 3e-4)
        << "B/K, m " << c.law.exponent;
    EXPECT_LT(test::law_displacement_error(c.law, found, c.depth_mm), 0.021) << "m " << c.law.exponent;
    EXPECT_LT(fit->relative_error, 0.06) << "the error it shows itself, noise included";
  }
}

TEST(Identify, FindsAHuntCrossleyLawExactlyWhereNothingDisturbs) {
  const rt::HuntCrossleyParameters truth{0.05, 0.0, 1.8};
  const auto fit = fit_hunt_crossley(
      palpate([&](double x, double rate) { return rt::hunt_crossley_force_n(truth, x, rate); },
              {{10.0, 0.5, 6.0}, {6.0, 1.0, 3.0}}, 0.0, 0.0));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->parameters.exponent, 1.8, 1e-6);
  EXPECT_NEAR(fit->parameters.stiffness_n_per_mm_m, 0.05, 1e-6);
}

/// A creep law's displacement under given forces.
std::vector<PalpationSample> creep_palpation(const rt::CreepParameters& truth, double noise_n) {
  std::mt19937_64 random(61);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<PalpationSample> samples;
  rt::CreepLaw law(truth, 1000.0);
  double before = 0.0;
  for (int i = 0; i < 24'000; ++i) {
    const double t = 1e-3 * i;
    double force =
        std::max(0.0, (1.2 + 0.8 * std::sin(0.7 * t)) * std::sin(2.0 * std::numbers::pi * 0.4 * t));
    if (t > 14.0 && t < 18.0) force = 1.5 * std::min(1.0, 4.0 * (t - 14.0));  // a long hold
    PalpationSample s;
    s.displacement_mm = law.update(force).displacement_mm;
    s.rate_mm_per_s = (s.displacement_mm - before) * 1000.0;
    before = s.displacement_mm;
    s.in_contact = force > 0.0;
    s.normal_force_n = force + noise_n * noise(random);
    samples.push_back(s);
  }
  return samples;
}

TEST(Identify, FindsACreepLawsDisplacement) {
  const rt::CreepParameters truth = test::some_creep();
  for (const double noise_n : {0.0, 0.003}) {
    const auto palpation = creep_palpation(truth, noise_n);
    const auto fit = fit_creep(palpation, 1000.0);
    ASSERT_TRUE(fit) << fit.error().text();
    rt::CreepLaw found(fit->parameters, 1000.0);
    rt::CreepLaw law(truth, 1000.0);
    double squared = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < palpation.size(); ++i) {
      const double force = 1.0 + std::sin(1.7e-3 * static_cast<double>(i));  // another palpation
      const double x = law.update(force).displacement_mm;
      const double x_found = found.update(force).displacement_mm;
      if (x < 1.0) continue;
      squared += std::pow(x_found / x - 1.0, 2);
      ++count;
    }
    EXPECT_LT(std::sqrt(squared / count), 0.01) << noise_n << " N of noise";
    EXPECT_LT(fit->relative_error, 0.02);
  }
}

struct Stroking {
  hal::Vector3 normal{0.0, 0.0, 1.0};
  double radius_mm = 0.0;  ///< 0: a plane
  double noise_n = 0.003;
  double step_mm = 0.03;
  double reach_mm = 25.0;
};

std::vector<StrokeSample> strokes(const rt::FrictionParameters& friction, const Stroking& how) {
  std::mt19937_64 random(62);
  StrokedSurface surface(friction);
  const hal::Vector3 along = rt::direction_or(rt::across({1.0, 0.0, 0.0}, how.normal), {});
  const auto normal_at = [&](double s) {
    const double angle = how.radius_mm > 0.0 ? s / how.radius_mm : 0.0;
    return how.normal * std::cos(angle) + along * std::sin(angle);
  };
  std::vector<StrokeSample> samples;
  double before = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const double omega = 2.0 * std::numbers::pi * (i < 10'000 ? 0.5 : 1.0);
    const double t = 1e-3 * i;
    const double way = how.reach_mm * std::sin(omega * t);
    const double mm_per_s = how.reach_mm * omega * std::cos(omega * t);
    const hal::Vector3 normal = normal_at(way);
    const hal::Vector3 tangent = rt::direction_or(rt::across(along, normal), {});
    const hal::Vector3 felt = surface.move(tangent * (way - before), normal, 1.2 + 0.6 * std::sin(0.9 * t));
    before = way;
    StrokeSample s;
    const double along_mm = how.radius_mm > 0.0 ? how.radius_mm * std::sin(way / how.radius_mm) : way;
    s.along_mm = how.step_mm > 0.0 ? how.step_mm * std::round(along_mm / how.step_mm) : along_mm;
    s.along_mm_per_s = mm_per_s * dot(tangent, along);
    s.reaction_n = felt + random_vector(random, how.noise_n);
    samples.push_back(s);
  }
  return samples;
}

TEST(Identify, FindsFrictionWithoutKnowingTheSurface) {
  // What of friction and viscosity together is felt at 60 mm/s under 1.2 N.
  const auto felt_n = [](const rt::FrictionParameters& f) {
    return 1.2 * f.kinetic + 60.0 * f.viscous_n_s_per_mm;
  };
  for (const rt::FrictionParameters& truth :
       {rt::FrictionParameters{0.3, 0.3, 0.0}, rt::FrictionParameters{0.6, 0.5, 5e-4},
        rt::FrictionParameters{0.1, 0.2, 0.0}}) {
    for (const hal::Vector3& normal : {hal::Vector3{0.0, 0.0, 1.0}, rt::direction_or({0.3, 0.2, 1.0}, {})}) {
      for (const double radius_mm : {0.0, 50.0}) {
        Stroking how;
        how.normal = normal;
        how.radius_mm = radius_mm;
        const hal::Vector3 along = rt::direction_or(rt::across({1.0, 0.0, 0.0}, normal), {});
        const auto fit = fit_friction(strokes(truth, how), along);
        ASSERT_TRUE(fit) << fit.error().text();
        EXPECT_NEAR(felt_n(fit->parameters) / felt_n(truth), 1.0, 0.08) << "radius " << radius_mm;
        EXPECT_GT(fit->parameters.presliding_mm, 0.4 * truth.presliding_mm);
        EXPECT_LT(fit->parameters.presliding_mm, 2.0 * truth.presliding_mm);
        EXPECT_LT(fit->relative_error, 0.15);
      }
    }
  }
}

// Without noise. Right after a turn friction that preslides has not turned yet, and the mean of the two ways
// is not the normal: those samples must stay out of the bins.
TEST(Identify, FindsTheLevelOfFriction) {
  struct Case {
    rt::FrictionParameters truth;
    double kinetic, viscous_n_s_per_mm;  ///< tolerances
  };
  for (const Case& c : {Case{{0.3, 1e-3, 0.0}, 0.003, 2e-5}, Case{{0.6, 1e-3, 5e-4}, 0.003, 2e-5},
                        Case{{0.3, 0.3, 0.0}, 0.03, 1e-4}, Case{{0.6, 0.5, 5e-4}, 0.03, 1e-4}}) {
    Stroking how;
    how.noise_n = how.step_mm = 0.0;
    const auto fit = fit_friction(strokes(c.truth, how), {1.0, 0.0, 0.0});
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->parameters.kinetic / c.truth.kinetic, 1.0, c.kinetic);
    EXPECT_NEAR(fit->parameters.viscous_n_s_per_mm, c.truth.viscous_n_s_per_mm, c.viscous_n_s_per_mm);
  }
}

}  // namespace
}  // namespace hapticd::identification
