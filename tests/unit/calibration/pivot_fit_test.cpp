#include "server/calibration/estimate/pivot_fit.h"

#include <gtest/gtest.h>

#include "hal/sim/base/random.h"
#include "rt/arm/rigid_transform.h"
#include "tests/support/value_of.h"

namespace hapticd::calibration {
namespace {

const Eigen::Vector3d kTip(12.0, -7.0, -95.0);
const Eigen::Vector3d kPivot(300.0, 40.0, 900.0);

std::vector<ReferencePose> pivoted(double tilt_rad, double noise_mm = 0.3, double outlier_share = 0.0) {
  sim::Random random(3);
  std::vector<ReferencePose> poses;
  for (int i = 0; i < 900; ++i) {
    ReferencePose pose{.stamp_s = i / 60.0};
    const Eigen::Vector3d turn(tilt_rad * std::sin(0.9 * pose.stamp_s),
                               tilt_rad * std::cos(0.7 * pose.stamp_s), 0.1);
    pose.orientation = rt::rotation_by(turn);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    pose.position_mm = kPivot - *pose.orientation * kTip + noise_mm * noise;
    if (random.uniform() < outlier_share) pose.position_mm += 80.0 * noise;
    poses.push_back(pose);
  }
  return poses;
}

TEST(PivotFit, FindsTheTipWithinItsStandardError) {
  const auto fit = test::value_of(fit_pivot(pivoted(0.5, 0.3, 0.05)));
  const Eigen::Vector3d off = fit.tip_in_marker_mm - kTip;
  EXPECT_LT(off.norm(), 4.0 * std::sqrt(fit.covariance_mm2.trace()));
  EXPECT_LT(off.norm(), 0.3);
  EXPECT_GT(fit.outliers, 20U);
}

TEST(PivotFit, RefusesPosesThatTellNoTip) {
  const auto why_not = [](const std::vector<ReferencePose>& poses) {
    return test::error_of(fit_pivot(poses)).what;
  };
  EXPECT_EQ(why_not(pivoted(0.05)), "the tool turned too little");
  auto without_one_orientation = pivoted(0.5);
  without_one_orientation[5].orientation.reset();
  EXPECT_EQ(why_not(without_one_orientation), "the tracker sends no orientation");
  auto slid = pivoted(0.5);
  for (std::size_t i = 0; i < slid.size(); ++i) {
    if (i % 5 < 2) slid[i].position_mm.x() += 25.0;
  }
  EXPECT_EQ(why_not(slid), "the tip did not stay where it was");
  auto few = pivoted(0.5);
  few.resize(20);
  EXPECT_NE(why_not(few), "");
}

TEST(PivotFit, EndsSoonOnceItIsGivenUp) {
  int asked = 0;
  const auto fit = fit_pivot(pivoted(0.5, 0.3, 0.05), [&asked] { return ++asked > 3; });
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().what, "the fit was given up");
  EXPECT_EQ(asked, 4);
}

}  // namespace
}  // namespace hapticd::calibration
