#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "contact_synthetic.h"
#include "tests/reference/contact_fit.h"

namespace hapticd::identification {
namespace {

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
    const auto fit = test::value_of(fit_hunt_crossley(palpation));
    const rt::HuntCrossleyParameters& found = fit.parameters;
    EXPECT_NEAR(found.exponent, c.law.exponent, 0.04) << "m " << c.law.exponent;
    EXPECT_NEAR(found.stiffness_n_per_mm_m / c.law.stiffness_n_per_mm_m, 1.0, 0.10) << "m " << c.law.exponent;
    EXPECT_NEAR(found.damping_n_s_per_mm_m1 / found.stiffness_n_per_mm_m,
                c.law.damping_n_s_per_mm_m1 / c.law.stiffness_n_per_mm_m, 3e-4)
        << "B/K, m " << c.law.exponent;
    EXPECT_LT(test::law_displacement_error(c.law, found, c.depth_mm), 0.021) << "m " << c.law.exponent;
    EXPECT_LT(fit.relative_error, 0.06) << "the error it shows itself, noise included";
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
    const auto fit = test::value_of(fit_creep(palpation, 1000.0));
    rt::CreepLaw found(fit.parameters, 1000.0);
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
    EXPECT_LT(fit.relative_error, 0.02);
  }
}

}  // namespace
}  // namespace hapticd::identification
