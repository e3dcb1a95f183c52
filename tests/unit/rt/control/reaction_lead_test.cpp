#include "rt/control/reaction_lead.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr double kLeadHz = 1000.0;
constexpr double kLeadS = 3.5e-3;

TickInterval after_ms(double ms) {
  return {1e-3 * ms, ms, ms, false};
}

/// Lead of a reaction that grows evenly, after half a second of ticks that are `tick_ms` apart.
double after_a_ramp(double rate_n_per_s, double tick_ms) {
  ReactionLead lead(kLeadS, kLeadHz);
  double ahead_n = 0.0;
  for (double ms = tick_ms; ms < 500.0; ms += tick_ms) {
    ahead_n = lead.update(1e-3 * ms * rate_n_per_s, after_ms(tick_ms));
  }
  return ahead_n;
}

TEST(ReactionLead, IsOffWithoutALead) {
  EXPECT_FALSE(ReactionLead(0.0, kLeadHz).is_on());
  EXPECT_TRUE(ReactionLead(kLeadS, kLeadHz).is_on());
}

TEST(ReactionLead, AddsNothingToAForceThatStands) {
  ReactionLead lead(kLeadS, kLeadHz);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(lead.update(0.0, after_ms(1.0)), 0.0);
  double ahead_n = 0.0;
  for (int i = 0; i < 1000; ++i) ahead_n = lead.update(5.0, after_ms(1.0));
  EXPECT_NEAR(ahead_n, 0.0, 1e-9);
}

TEST(ReactionLead, IsExactForASteadyRateWhateverTheInterval) {
  for (const double tick_ms : {0.2, 1.0, 5.0}) {
    EXPECT_NEAR(after_a_ramp(20.0, tick_ms), kLeadS * 20.0, 1e-3 * kLeadS * 20.0) << tick_ms << " ms";
  }
}

TEST(ReactionLead, DampsWhatIsFasterThanItsCutoff) {
  // The part of the answer in quadrature: ahead of the force it takes damping, behind it it gives some.
  for (const double times_cutoff : {1.25, 2.0, 5.0, 10.0}) {
    const double hz = times_cutoff * ReactionLead::kCutoffHz;
    ReactionLead lead(kLeadS, kLeadHz);
    std::complex<double> answer;
    for (int i = 0; i < 2000; ++i) {
      const double angle = 2.0 * std::numbers::pi * hz * i / kLeadHz;
      const double ahead_n = lead.update(std::sin(angle), after_ms(1.0));
      if (i >= 1000) answer += ahead_n * std::complex<double>(std::sin(angle), std::cos(angle)) / 500.0;
    }
    EXPECT_LT(answer.imag(), 0.0) << hz << " Hz";
    EXPECT_LT(std::abs(answer), kLeadS * std::numbers::pi * ReactionLead::kCutoffHz * 1.01) << hz << " Hz";
  }
}

TEST(ReactionLead, AJumpIsAnsweredByAFractionOfIt) {
  ReactionLead lead(kLeadS, kLeadHz);
  double largest = 0.0;
  for (int i = 0; i < 200; ++i) largest = std::max(largest, lead.update(10.0, after_ms(1.0)));
  EXPECT_LT(largest,
            10.0 * kLeadS * 2.0 * std::numbers::pi * ReactionLead::kCutoffHz / std::numbers::e * 1.05);
  EXPECT_GT(largest, 0.0);
}

TEST(ReactionLead, KnowsNoSlopeAcrossAGap) {
  ReactionLead lead(kLeadS, kLeadHz);
  lead.update(0.0, after_ms(1.0));
  EXPECT_EQ(lead.update(8.0, {1e-3, 1.0, 50.0, true}), 0.0);
  EXPECT_EQ(lead.update(8.0, after_ms(1.0)), 0.0);
}

TEST(ReactionLead, ForgetsABadNumberWithTheReset) {
  ReactionLead lead(kLeadS, kLeadHz);
  EXPECT_TRUE(std::isnan(lead.update(std::numeric_limits<double>::quiet_NaN(), after_ms(1.0))))
      << "for the guard to see";
  lead.reset();
  EXPECT_EQ(lead.update(0.0, after_ms(1.0)), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
