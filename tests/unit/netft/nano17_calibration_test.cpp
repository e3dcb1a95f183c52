#include "hal/nano17_calibration.h"

#include <gtest/gtest.h>

namespace hapticd::hal {
namespace {

TEST(Nano17Calibration, IsFoundByModelAndByTheManufacturersName) {
  const auto by_model = find_nano17_calibration("nano17_si_25", "here");
  const auto by_name = find_nano17_calibration("SI-25-0.25", "here");
  ASSERT_TRUE(by_model);
  ASSERT_TRUE(by_name);
  EXPECT_EQ(by_name->model, by_model->model);
  EXPECT_EQ(by_model->range_across_n, 25.0);
  EXPECT_EQ(by_model->range_along_n, 35.0);
  EXPECT_EQ(by_model->range_torque_n_mm, 250.0);
  EXPECT_EQ(by_model->resolution_n, 1.0 / 160.0);
}

TEST(Nano17Calibration, RefusesOthersAndNamesThoseThereAre) {
  const auto none = find_nano17_calibration("gamma", "[rig.netft] model");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().limit, "nano17_si_12, nano17_si_25, nano17_si_50");
}

}  // namespace
}  // namespace hapticd::hal
