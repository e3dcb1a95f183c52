#include <gtest/gtest.h>

#include <cmath>

#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"

namespace hapticd::rt {
namespace {

ContactDetector armed(const ContactParameters& parameters = {}) {
  ContactDetector detector(parameters);
  for (std::uint32_t i = 0; i < parameters.free_ticks_to_arm; ++i) detector.update(0.0, 0.0, 0.0);
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
  ContactDetector detector{ContactParameters{}};
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(detector.update(2.0, 0.0, 0.0));
  EXPECT_EQ(detector.reason(), ContactReason::kAwaitingFree);
  for (std::uint32_t i = 0; i < ContactParameters{}.free_ticks_to_arm; ++i) detector.update(0.0, 0.0, 0.0);
  EXPECT_TRUE(detector.update(2.0, 0.0, 0.0));
}

TEST(ContactDetector, OneQuietSampleEndsNoContact) {
  const ContactParameters parameters;
  ContactDetector detector = armed();
  detector.update(1.0, 0.0, 0.0);
  for (int repeat = 0; repeat < 10; ++repeat) {
    for (std::uint32_t i = 1; i < parameters.release_ticks; ++i) EXPECT_TRUE(detector.update(0.0, 0.0, 0.0));
    EXPECT_TRUE(detector.update(0.008, 0.0, 0.0)) << "above the release level, below the threshold";
    EXPECT_EQ(detector.reason(), ContactReason::kHeld);
  }
  for (std::uint32_t i = 1; i < parameters.release_ticks; ++i) EXPECT_TRUE(detector.update(0.0, 0.0, 0.0));
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

TEST(ContactDetector, AdhesionAboveTheSurfaceIsNoNewContact) {
  ContactDetector detector = armed();
  detector.update(1.0, 10.0, 10.0);
  detector.update(1.0, 9.4, 10.0);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(detector.update(-0.1, 9.3, 10.0)) << "still pulled, still away";
  EXPECT_TRUE(detector.update(0.1, 10.1, 10.0)) << "a bounce: the tip is back at the surface";
}

TEST(ContactDetector, AfterAQuietWhileAContactMayBeAnywhere) {
  ContactDetector detector = armed();
  detector.update(1.0, 10.0, 10.0);
  detector.update(1.0, 9.4, 10.0);
  for (std::uint32_t i = 0; i < ContactParameters{}.quiet_ticks_after_release; ++i)
    detector.update(0.0, 5.0, 10.0);
  EXPECT_TRUE(detector.update(0.1, 5.0, 10.0)) << "another object, higher up";
}

TEST(ContactDetector, NotANumberIsNoContact) {
  ContactDetector detector = armed();
  EXPECT_FALSE(detector.update(std::nan(""), 0.0, 0.0));
}

TEST(ContactOnset, FindsTheLastQuietTick) {
  ContactOnset onset;
  for (int i = 0; i < 40; ++i) onset.remember(0.1 * i, i <= 30 ? 0.002 : 0.01 * (i - 30));
  EXPECT_NEAR(onset.place_mm(0.0075), 3.0, 1e-12);
}

TEST(ContactOnset, FallsBackOnTheOldestItRemembers) {
  ContactOnset onset;
  for (int i = 0; i < 100; ++i) onset.remember(i, 1.0);
  EXPECT_EQ(onset.place_mm(0.0075), 100.0 - static_cast<double>(ContactOnset::kMemory));
  onset.forget();
  onset.remember(7.0, 1.0);
  EXPECT_EQ(onset.place_mm(0.0075), 7.0);
}

}  // namespace
}  // namespace hapticd::rt
