#include "rt/contact/contact_evidence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hapticd::rt {
namespace {

constexpr double kThresholdN = 0.015;
constexpr double kToolG = 12.6;
const EvidenceParameters kParameters{};

TickInterval interval_at(double rate_hz) {
  return {1.0 / rate_hz, 1.0, 1.0, false};
}

/// Drives a contact and remembers the most that was ever allowed.
struct Contact {
  explicit Contact(double rate = 1000.0) : rate_hz(rate), evidence(kParameters, kThresholdN, kToolG) {
    evidence.begin();
  }
  void tick(double force_n, double depth_mm, double acceleration = 0.0) {
    evidence.update({force_n, depth_mm, depth_mm, acceleration, 0.0}, interval_at(rate_hz));
    largest = std::max(largest, evidence.authority());
  }
  int ticks(double seconds) const { return static_cast<int>(seconds * rate_hz); }

  double rate_hz;
  ContactEvidence evidence;
  double largest = 0.0;
};

TEST(ContactEvidence, APressedObjectMayBeRenderedInFullAtTwiceTheUnexplainedForce) {
  for (const double rate_hz : {500.0, 1000.0, 5000.0, 10000.0}) {
    for (const double n_per_mm : {0.05, 0.3, 2.0, 50.0}) {
      Contact contact(rate_hz);
      double full_at_n = 0.0;
      for (int i = 0; i < contact.ticks(4.0); ++i) {
        const double force_n = 0.5 * i / rate_hz;  // 0.5 N/s
        contact.tick(force_n, force_n / n_per_mm);
        const double earned = std::clamp(force_n / 0.1 - 1.0, 0.0, 1.0 - 1e-9);
        EXPECT_LE(std::min(contact.evidence.max_force_n(), 1e6), 0.25 / (1.0 - earned) + 1e-6);
        if (full_at_n == 0.0 && std::isinf(contact.evidence.max_force_n())) full_at_n = force_n;
      }
      EXPECT_NEAR(full_at_n, 0.205, 0.01) << n_per_mm << " N/mm at " << rate_hz << " Hz";
      EXPECT_TRUE(contact.evidence.plausible());
    }
  }
}

TEST(ContactEvidence, ASlopeEarnsAuthorityBelowTheUnexplainedForce) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.003);
  for (const double n_per_mm : {0.1, 0.3, 1.0}) {
    for (const double mm_per_s : {5.0, 20.0, 80.0}) {
      Contact contact;
      double path_mm = 0.0;
      while (contact.evidence.authority() < 0.5 && path_mm < 3.0) {
        path_mm += 1e-3 * mm_per_s;
        // A zero that is off by 20 mN has no slope.
        contact.tick(0.02 + n_per_mm * path_mm + noise(random), path_mm);
      }
      // Six ticks make a fit, two are needed, and half of the authority takes three more.
      EXPECT_LT(0.02 + n_per_mm * path_mm, 0.1 + 15e-3 * mm_per_s * n_per_mm) << n_per_mm << ", " << mm_per_s;
    }
  }
}

TEST(ContactEvidence, WhatDoesNotGrowWithThePathEarnsNoSlope) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 0.003);
  // A wrong zero, one that drifts, a tool of another mass that is waved; each for a minute.
  for (const int cause : {0, 1, 2}) {
    Contact contact;
    for (int i = 0; i < 60000; ++i) {
      const double t = 1e-3 * i;
      const double omega = 2.0 * 3.14159 * 1.3;
      const double path_mm = 10.0 + 10.0 * std::sin(omega * t);
      const double inward = -10.0 * omega * omega * std::sin(omega * t);
      const double mass_error_n = cause == 2 ? 1e-6 * 5.0 * inward : 0.0;
      contact.evidence.update({0.05 + (cause == 1 ? 5e-4 * t : 0.0) + mass_error_n + noise(random), 0.1,
                               path_mm, std::abs(inward), inward},
                              interval_at(1000.0));
      contact.largest = std::max(contact.largest, contact.evidence.authority());
    }
    EXPECT_EQ(contact.largest, 0.0) << cause;
  }
}

TEST(ContactEvidence, AnImpactCountsAtOnce) {
  Contact contact;
  double full_after_ms = 0.0;
  for (int i = 0; full_after_ms == 0.0 && i < 50; ++i) {
    contact.tick(0.3 * i, 0.4 * i);  // 400 mm/s into 0.75 N/mm
    if (contact.evidence.authority() > 0.999) full_after_ms = i;
  }
  EXPECT_LE(full_after_ms, 8.0);
}

TEST(ContactEvidence, WhatASensorMayReadOfNothingEarnsNothing) {
  // A wrong zero, while the tip goes on through the air.
  for (const double force_n : {0.02, 0.05, -0.05, 0.099}) {
    Contact contact;
    double lost_at_mm = 0.0;
    for (int i = 0; i < 2000 && lost_at_mm == 0.0; ++i) {
      contact.tick(force_n, 0.1 * i);
      if (!contact.evidence.plausible()) lost_at_mm = 0.1 * i;
    }
    EXPECT_EQ(contact.largest, 0.0) << force_n;
    EXPECT_GT(lost_at_mm, 0.0) << "it is ended";
    EXPECT_LT(lost_at_mm, 0.5 + std::max(0.0, force_n) / kParameters.lowest_stiffness_n_per_mm + 0.8);
    EXPECT_FALSE(contact.evidence.proven());
  }
}

TEST(ContactEvidence, InertiaThatTheEncodersShowEarnsNothing) {
  // The whole of the tool's inertia left uncompensated, as with a sensor that is late: 20 m/s² from rest,
  // seen by the encoders 8 ms later.
  for (const double rate_hz : {1000.0, 5000.0}) {
    Contact contact(rate_hz);
    for (int i = 0; i < contact.ticks(0.1); ++i) {
      const double t = i / rate_hz;
      contact.tick(1e-6 * kToolG * 20e3, 0.5 * 20e3 * t * t, t < 0.008 ? 0.0 : 20e3);
    }
    EXPECT_EQ(contact.largest, 0.0) << rate_hz;
  }
}

TEST(ContactEvidence, OneGlitchOfTheSensorRendersNothing) {
  Contact contact;
  for (int i = 0; i < 100; ++i) contact.tick(i == 20 ? 5.0 : 0.02, 0.01 * i);
  EXPECT_LT(contact.largest, 0.25) << "for that tick only";
  EXPECT_EQ(contact.evidence.authority(), 0.0);
}

TEST(ContactEvidence, AnObjectThatVanishesTakesTheForceWithIt) {
  for (const double rate_hz : {1000.0, 5000.0}) {
    Contact contact(rate_hz);
    for (int i = 0; i < contact.ticks(1.0); ++i) contact.tick(3.0 * i / rate_hz, 8.0 * i / rate_hz);
    ASSERT_EQ(contact.evidence.authority(), 1.0);
    // The tool is thrown on, and its inertia reads as a reaction of 0.25 N for a while.
    contact.tick(0.25, 8.0, 20e3);
    EXPECT_EQ(contact.evidence.authority(), 0.0) << "in the very tick";
    int until_ended = 1;
    while (contact.evidence.plausible() && until_ended < 1000) contact.tick(0.01, 8.2, 20e3), ++until_ended;
    EXPECT_LE(until_ended / rate_hz, 0.0062);
    EXPECT_TRUE(contact.evidence.proven()) << "it had been one";
  }
}

TEST(ContactEvidence, RelaxationAndSlowUnloadingTakeNothingAway) {
  Contact contact;
  for (int i = 0; i < 1000; ++i) contact.tick(0.003 * i, 0.008 * i);
  for (int i = 0; i < 5000; ++i) {  // half of it relaxes within a second
    contact.tick(1.5 + 1.5 * std::exp(-i * 1e-3), 8.0);
    ASSERT_EQ(contact.evidence.authority(), 1.0) << i;
  }
  for (int i = 0; i < 480; ++i) {  // unloaded along a line that comes to zero at half the depth
    const double depth_mm = 8.0 - 0.008 * i;
    contact.tick(1.5 * (depth_mm - 4.0) / 4.0, depth_mm);
    if (depth_mm > 5.0) {
      ASSERT_EQ(contact.evidence.authority(), 1.0) << depth_mm;
    }
  }
}

TEST(ContactEvidence, TheForceOfALastReactionFadesInsteadOfFlickering) {
  Contact contact;
  for (int i = 0; i < 1000; ++i) contact.tick(0.001 * i, 0.003 * i);
  double before = 1.0;
  for (int i = 0; i < 1000; ++i) {  // down to nothing, with a sensor's noise on it
    contact.tick(std::max(0.0, 1.0 - 0.001 * i) + (i % 2 == 0 ? 0.002 : -0.002), 3.0 - 0.0028 * i);
    EXPECT_LE(std::abs(contact.evidence.authority() - before), 0.3) << i;
    before = contact.evidence.authority();
  }
  EXPECT_EQ(before, 0.0);
}

TEST(ContactEvidence, NotRequiredItAllowsEverything) {
  EvidenceParameters published;
  published.required = false;
  ContactEvidence evidence(published, kThresholdN, kToolG);
  evidence.begin();
  for (int i = 0; i < 100; ++i) evidence.update({0.0, 1.0 * i, 1.0 * i, 0.0, 0.0}, interval_at(1000.0));
  EXPECT_EQ(evidence.authority(), 1.0);
  EXPECT_TRUE(evidence.plausible());
}

}  // namespace
}  // namespace hapticd::rt
