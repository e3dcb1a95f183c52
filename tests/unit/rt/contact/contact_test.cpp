#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"

namespace hapticd::rt {
namespace {

constexpr double kCountedHz = 1000.0;

ContactDetector armed(const ContactParameters& parameters = {}) {
  ContactDetector detector(parameters, kCountedHz);
  for (std::uint32_t i = 0; i < parameters.arming_time_ms; ++i) detector.update(0.0, 0.0, 0.0);
  return detector;
}

TEST(ContactDetector, DeclaresAboveTheThresholdInEitherDirection) {
  for (const double sign : {1.0, -1.0}) {
    ContactDetector detector = armed();
    EXPECT_FALSE(detector.update(sign * 0.015, 0.0, 0.0)) << "at the threshold is not above it";
    EXPECT_TRUE(detector.update(sign * 0.0151, 0.0, 0.0));
    EXPECT_EQ(detector.reason(), ContactReason::kAboveThreshold);
    EXPECT_EQ(detector.count(), 1U);
  }
}

TEST(ContactDetector, IsNotArmedUnderLoad) {
  ContactDetector detector(ContactParameters{}, kCountedHz);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(detector.update(2.0, 0.0, 0.0));
  EXPECT_EQ(detector.reason(), ContactReason::kAwaitingFree);
  for (std::uint32_t i = 0; i < ContactParameters{}.arming_time_ms; ++i) detector.update(0.0, 0.0, 0.0);
  EXPECT_TRUE(detector.update(2.0, 0.0, 0.0));
}

TEST(ContactDetector, OneQuietSampleEndsNoContact) {
  const ContactParameters parameters;
  ContactDetector detector = armed();
  detector.update(1.0, 0.0, 0.0);
  for (int repeat = 0; repeat < 10; ++repeat) {
    for (std::uint32_t i = 1; i < parameters.release_time_ms; ++i)
      EXPECT_TRUE(detector.update(0.0, 0.0, 0.0));
    EXPECT_TRUE(detector.update(0.008, 0.0, 0.0)) << "above the release level, below the threshold";
    EXPECT_EQ(detector.reason(), ContactReason::kHeld);
  }
  for (std::uint32_t i = 1; i < parameters.release_time_ms; ++i) EXPECT_TRUE(detector.update(0.0, 0.0, 0.0));
  EXPECT_FALSE(detector.update(0.0, 0.0, 0.0));
  EXPECT_EQ(detector.reason(), ContactReason::kBelowRelease);
}

TEST(ContactDetector, DrawnBackPastTheContactPointThereIsNoObject) {
  ContactDetector detector = armed();
  detector.update(1.0, 10.0, 10.0);
  EXPECT_TRUE(detector.update(1.0, 9.6, 10.0));
  EXPECT_FALSE(detector.update(1.0, 9.4, 10.0));
  EXPECT_EQ(detector.reason(), ContactReason::kAboveSurface);
  EXPECT_TRUE(detector.just_left_surface());
}

/// Ticks under force of unknown depth are what a creep law is fed with: those before a reset are not of the
/// object that is met after it.
TEST(ContactDetector, AResetForgetsTheForceItRestedUnder) {
  ContactDetector detector = armed();
  detector.update(1.0, 10.0, 10.0);
  EXPECT_FALSE(detector.update(1.0, 9.4, 10.0));
  for (int i = 0; i < 5; ++i) detector.update(1.0, 5.0, 10.0);
  ASSERT_GT(detector.disturbed_ticks(), 0U);
  detector.reset();
  EXPECT_EQ(detector.disturbed_ticks(), 0U);
}

TEST(ContactDetector, AdhesionAboveTheSurfaceIsNoNewContact) {
  ContactDetector detector = armed();
  detector.update(1.0, 10.0, 10.0);
  detector.update(1.0, 9.4, 10.0);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(detector.update(-0.1, 9.3, 10.0)) << "still pulled, still away";
  EXPECT_TRUE(detector.update(0.1, 10.1, 10.0)) << "a bounce: the tip is back at the surface";
}

TEST(ContactDetector, NotANumberIsNoContact) {
  ContactDetector detector = armed();
  EXPECT_FALSE(detector.update(std::nan(""), 0.0, 0.0));
}

TEST(ContactOnset, FindsTheLastQuietTickAndGoesBackByWhatTheForceIsLater) {
  for (const auto& [late_s, place_mm] : {std::pair{0.0, 3.0}, {0.0035, 2.7}}) {  // three whole ticks
    ContactOnset onset(kCountedHz);
    for (int i = 0; i < 40; ++i) onset.remember(0.1 * i, i <= 30 ? 0.002 : 0.01 * (i - 30), 0, late_s);
    EXPECT_NEAR(onset.place_mm(0.0075), place_mm, 1e-12);
  }
}

TEST(ContactDetector, WhatItCountsLastsAsLongAtAnyRate) {
  const ContactParameters parameters;
  for (const double rate_hz : {500.0, 2000.0, 4000.0, 5000.0, 10000.0}) {
    const double tick_ms = 1e3 / rate_hz;
    ContactDetector detector(parameters, rate_hz);
    int ticks = 0;
    while (detector.reason() == ContactReason::kAwaitingFree) detector.update(0.0, 0.0, 0.0), ++ticks;
    EXPECT_NEAR(ticks * tick_ms, parameters.arming_time_ms, 0.51 * tick_ms);

    detector.update(1.0, 10.0, 10.0);
    for (ticks = 1; detector.update(0.0, 10.0, 10.0); ++ticks)
      ;
    EXPECT_NEAR(ticks * tick_ms, parameters.release_time_ms, 0.51 * tick_ms);

    // Force that does not end, away from the last surface: for a second it counts as nothing, then as
    // unknown.
    for (ticks = 0; detector.reason() != ContactReason::kAwaitingFree && ticks < 20'000; ++ticks) {
      EXPECT_FALSE(detector.update(0.1, 5.0, 10.0));
    }
    EXPECT_NEAR(ticks * tick_ms, 1000.0, 1.1 * tick_ms);
  }
}

TEST(ContactDetector, AfterAReleaseItWaitsAsLongAtAnyRate) {
  for (const double rate_hz : {500.0, 5000.0, 10000.0}) {
    const auto quiet_ms_before = [rate_hz](double quiet_ms) {
      ContactDetector detector(ContactParameters{}, rate_hz);
      for (int i = 0; i < 1000; ++i) detector.update(0.0, 0.0, 0.0);
      detector.update(1.0, 10.0, 10.0);
      detector.update(1.0, 9.4, 10.0);
      for (int i = 0; i < std::lround(1e-3 * quiet_ms * rate_hz); ++i) detector.update(0.0, 5.0, 10.0);
      return detector.update(0.1, 5.0, 10.0);
    };
    EXPECT_FALSE(quiet_ms_before(90.0)) << rate_hz;
    EXPECT_TRUE(quiet_ms_before(100.0)) << rate_hz;
  }
}

TEST(ContactOnset, RemembersAsLongAtAnyRate) {
  constexpr double kMmPerS = 10.0;
  for (const double rate_hz : {500.0, 1000.0, 4000.0, 10000.0}) {
    ContactOnset onset(rate_hz);
    const double step_mm = kMmPerS / rate_hz;
    for (int i = 0; i < 2000; ++i) onset.remember(step_mm * i, 1.0);
    EXPECT_NEAR(step_mm * 1999 - onset.place_mm(0.0075), kMmPerS * 0.032, 1.01 * step_mm) << rate_hz;
    EXPECT_LE(onset.memory_ticks(), ContactOnset::kMaxTicks);
  }
  ContactOnset beyond(50'000.0);
  EXPECT_EQ(beyond.memory_ticks(), ContactOnset::kMaxTicks);
}

TEST(ContactOnset, ForgettingItKnowsNoPlaceAtAnyRate) {
  for (const double rate_hz : {500.0, 1000.0, 10000.0}) {
    ContactOnset onset(rate_hz);
    for (int i = 0; i < 500; ++i) onset.remember(i, 1.0);
    onset.forget();
    EXPECT_EQ(onset.place_mm(0.0075), 0.0);
    onset.remember(7.0, 0.0);
    EXPECT_EQ(onset.place_mm(0.0075), 7.0);
  }
}

/// What a sensor of 10 kHz and an encoder make of a tool's way, at a loop of any rate.
class Approach {
 public:
  Approach(double rate_hz, unsigned seed) : rate_hz_(rate_hz), random_(seed), residual_(kToolG, rate_hz) {}

  /// The tip is truly at `depth_mm` and bears `force_n` besides its inertia.
  bool update(double depth_mm, double force_n) {
    std::normal_distribution<double> noise(0.0, kNoiseN * std::sqrt(rate_hz_ / kSensorHz));
    const double read_mm = std::round(depth_mm / kEncoderMm) * kEncoderMm;
    time_ns_ += std::llround(1e9 / rate_hz_);
    const double r = residual_.update(force_n + noise(random_), read_mm, time_ns_, detector_.in_contact());
    onset_.remember(read_mm, residual_.prompt_force_n());
    return detector_.update(r, read_mm, 0.0);
  }
  /// Surface as a scene looks for it.
  double surface_mm() const {
    const ContactParameters parameters;
    return onset_.place_mm(parameters.release_ratio * parameters.threshold_n + residual_.seen_jerk_n());
  }

  static constexpr double kToolG = 9.35;

 private:
  static constexpr double kSensorHz = 10'000.0;
  static constexpr double kNoiseN = 6.3e-3;  // of one of its samples
  static constexpr double kEncoderMm = 0.007;

  double rate_hz_;
  std::mt19937 random_;
  FreeMotionResidual residual_;
  ContactDetector detector_{ContactParameters{}, rate_hz_};
  ContactOnset onset_{rate_hz_};
  std::int64_t time_ns_ = 0;
};

/// Mean over approaches of where the surface, truly at 0, is taken to be.
double mean_surface_mm(double rate_hz, double stiffness_n_per_mm, double speed_mm_per_s) {
  constexpr int kApproaches = 100;
  double sum_mm = 0.0;
  for (unsigned seed = 1; seed <= kApproaches; ++seed) {
    Approach approach(rate_hz, seed);
    const double from_mm = -0.3 * speed_mm_per_s - 1e-4 * seed;
    for (int i = 0; i < 2.0 * rate_hz; ++i) {
      const double depth_mm = from_mm + speed_mm_per_s * i / rate_hz;
      // A tick's force is the mean since the last one.
      const double mean_depth_mm = depth_mm - 0.5 * speed_mm_per_s / rate_hz;
      if (approach.update(depth_mm, stiffness_n_per_mm * std::max(0.0, mean_depth_mm))) break;
    }
    sum_mm += approach.surface_mm() / kApproaches;
  }
  return sum_mm;
}

TEST(ContactOnset, OfARampIsTheSameSurfaceAtAnyRate) {
  for (const double speed_mm_per_s : {15.0, 40.0}) {
    const double at_1_khz_mm = mean_surface_mm(1000.0, 0.4, speed_mm_per_s);
    EXPECT_GT(at_1_khz_mm, 0.0);
    EXPECT_LT(at_1_khz_mm, 0.03);
    // Ticks of 1 kHz lie up to a millisecond's way apart; half of it, less what the means have in common.
    const double within_mm = 0.004 + 0.3e-3 * speed_mm_per_s;
    for (const double rate_hz : {2000.0, 4000.0, 5000.0, 10000.0}) {
      const double surface_mm = mean_surface_mm(rate_hz, 0.4, speed_mm_per_s);
      EXPECT_NEAR(surface_mm, at_1_khz_mm, within_mm) << rate_hz << " Hz, " << speed_mm_per_s << " mm/s";
      EXPECT_GT(surface_mm, 0.0) << rate_hz;
    }
  }
}

TEST(ContactDetector, ASwingingToolAndOneAtRestAreNoContactAtAnyRate) {
  constexpr double kOmega = 2.0 * std::numbers::pi * 3.0;
  for (const double rate_hz : {500.0, 1000.0, 4000.0, 5000.0, 10000.0}) {
    for (const double swing_mm : {20.0, 0.0}) {
      Approach swing(rate_hz, 1);
      int in_contact = 0;
      for (int i = 0; i < (swing_mm > 0.0 ? 20.0 : 60.0) * rate_hz; ++i) {
        const double phase = kOmega * i / rate_hz;
        const double inertia_n = -1e-6 * Approach::kToolG * swing_mm * kOmega * kOmega * std::sin(phase);
        if (swing.update(swing_mm * std::sin(phase), inertia_n)) ++in_contact;
      }
      EXPECT_EQ(in_contact, 0) << rate_hz << " Hz, " << swing_mm << " mm";
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
