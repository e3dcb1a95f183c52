#include "client/cli/commands/target_law.h"

#include <gtest/gtest.h>

#include "client/cli/session/session.h"
#include "client/cli/view/target_view.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

TEST(TargetLaw, IsReadFromTheCommandLine) {
  const auto power = parse_hunt_crossley("0.05,1e-3,1.6");
  EXPECT_EQ(power.stiffness_n_per_mm_m(), 0.05);
  EXPECT_EQ(power.damping_n_s_per_mm_m1(), 0.001);
  EXPECT_EQ(power.exponent(), 1.6);
  const auto profile = parse_profile("-20:0.3,20:0.8", "--position-profile");
  ASSERT_EQ(profile.knots_size(), 2);
  EXPECT_EQ(profile.knots(0).at_mm(), -20.0);
  EXPECT_EQ(profile.knots(0).stiffness_n_per_mm(), 0.3);
  EXPECT_EQ(profile.knots(1).at_mm(), 20.0);
  EXPECT_EQ(parse_axis("y").y(), 1.0);
  EXPECT_EQ(parse_axis("1,-2,0.5").y(), -2.0);
}

TEST(TargetLaw, IsShownAsItIsWritten) {
  v1::TargetLaw law;
  EXPECT_EQ(target_words(law), "unknown");
  law.set_linear_n_per_mm(0.5);
  EXPECT_EQ(target_words(law), "linear, 0.5 N/mm");
  *law.mutable_hunt_crossley() = parse_hunt_crossley("0.05,1e-3,1.6");
  EXPECT_EQ(target_words(law), "Hunt-Crossley, K 0.05, B 0.001, M 1.6");
  *law.mutable_displacement_profile() = parse_profile("0:0.2,5:0.8", "--displacement-profile");
  EXPECT_EQ(target_words(law), "profile by displacement, 0:0.2,5:0.8 (mm:N/mm)");
  v1::StiffnessProfile& profile = *law.mutable_position_profile();
  profile = parse_profile("-20:0.3,20:0.8", "--position-profile");
  EXPECT_EQ(target_words(law), "profile by position along x, -20:0.3,20:0.8 (mm:N/mm)");
  *profile.mutable_axis() = parse_axis("y");
  EXPECT_EQ(target_words(law), "profile by position along y, -20:0.3,20:0.8 (mm:N/mm)");
  *profile.mutable_axis() = parse_axis("1,1,0");
  EXPECT_EQ(target_words(law), "profile by position along 1,1,0, -20:0.3,20:0.8 (mm:N/mm)");
}

TEST(TargetLaw, AMalformedLawIsReportedWithItsForm) {
  for (const char* text : {"", "1,2", "1,2,3,4", "1,2,x", "1,,2", "1,2,3 "}) {
    EXPECT_THROW(parse_hunt_crossley(text), LocalError) << text;
  }
  for (const char* text : {"", "1", "1:2,", "1:2:3", "a:1", "1:2;3:4"}) {
    EXPECT_THROW(parse_profile(text, "--displacement-profile"), LocalError) << text;
  }
  for (const char* text : {"", "w", "1,2", "xyz"}) EXPECT_THROW(parse_axis(text), LocalError) << text;
  const LocalError error = test::thrown_by<LocalError>([&] { parse_profile("1", "--displacement-profile"); });
  EXPECT_EQ(error.detail().where(), "--displacement-profile");
  EXPECT_EQ(error.detail().value(), "1");
  EXPECT_EQ(error.detail().limit(), "MM:N_PER_MM,…");
}

}  // namespace
}  // namespace hapticd::cli
