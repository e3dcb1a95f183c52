#include "rt/target/contact_release.h"

#include <gtest/gtest.h>

namespace hapticd::rt {
namespace {

constexpr TickInterval kTick{0.001, 1.0, 1.0, false};

TEST(ContactRelease, IsFreeBeforeAnyContact) {
  ContactRelease release(false);
  release.update(false, 1.0, 3.0, kTick);
  EXPECT_FALSE(release.is_rendered());
  EXPECT_EQ(release.authority(), 0.0);
  EXPECT_EQ(release.displacement_mm(), 0.0);
}

TEST(ContactRelease, HeldItFollowsEvidenceAndDisplacement) {
  ContactRelease release(false);
  release.update(true, 0.0, -0.1, kTick);
  EXPECT_TRUE(release.is_rendered()) << "also before there is any evidence";
  EXPECT_EQ(release.authority(), 0.0);
  EXPECT_EQ(release.displacement_mm(), 0.0) << "above the surface nothing is rendered";
  release.update(true, 0.75, 2.5, kTick);
  EXPECT_EQ(release.authority(), 0.75);
  EXPECT_EQ(release.displacement_mm(), 2.5);
}

TEST(ContactRelease, FadesFromWhatWasAllowedWithin12MsAtADepthThatOnlyShrinks) {
  ContactRelease release(false);
  release.remember({0.0, 0.0, 2.0});
  release.update(true, 0.6, 2.0, kTick);
  double share = release.authority();
  double depth_mm = release.displacement_mm();
  for (int i = 1; i < 12; ++i) {
    release.update(false, 0.0, i % 2 == 0 ? 5.0 : 2.0 - 0.1 * i, kTick);
    EXPECT_NEAR(release.authority(), 0.6 * (1.0 - i / 12.0), 1e-12);
    EXPECT_LT(release.authority(), share);
    EXPECT_LE(release.displacement_mm(), depth_mm);
    EXPECT_EQ(release.last_desired_n().z, 2.0);
    share = release.authority();
    depth_mm = release.displacement_mm();
  }
  release.update(false, 0.0, 2.0, kTick);
  release.update(false, 0.0, 2.0, kTick);
  EXPECT_FALSE(release.is_rendered());
}

TEST(ContactRelease, IsOverAtTheSurface) {
  ContactRelease release(false);
  release.update(true, 1.0, 2.0, kTick);
  release.update(false, 0.0, 0.0, kTick);
  EXPECT_FALSE(release.is_rendered());
}

TEST(ContactRelease, CutItIsOverAtOnce) {
  ContactRelease release(true);
  release.update(true, 1.0, 2.0, kTick);
  EXPECT_TRUE(release.is_rendered());
  release.update(false, 0.0, 2.0, kTick);
  EXPECT_FALSE(release.is_rendered());
}

TEST(ContactRelease, AContactTakesOverFromAFade) {
  ContactRelease release(false);
  release.update(true, 1.0, 2.0, kTick);
  release.update(false, 0.0, 1.0, kTick);
  release.update(true, 0.1, 3.0, kTick);
  EXPECT_EQ(release.authority(), 0.1);
  EXPECT_EQ(release.displacement_mm(), 3.0);
}

TEST(ContactRelease, ForgetsAContactOnReset) {
  ContactRelease release(false);
  release.remember({1.0, 0.0, 0.0});
  release.update(true, 1.0, 2.0, kTick);
  release.reset();
  EXPECT_FALSE(release.is_rendered());
  EXPECT_EQ(release.displacement_mm(), 0.0);
  EXPECT_EQ(release.last_desired_n().x, 0.0);
}

}  // namespace
}  // namespace hapticd::rt
