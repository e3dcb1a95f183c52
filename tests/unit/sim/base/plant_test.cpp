// The choice between the families of objects, and what of the general one the whole rig shows.

#include "hal/sim/base/plant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::VirtualRig;

TEST(Plant, TheRigReportsWhichOneItIs) {
  const auto reports = [](const std::string& plant, const std::string& parameter) {
    VirtualRig rig({.plant = plant});
    const auto& all = rig.rig().info().uncertain;
    return std::any_of(all.begin(), all.end(),
                       [&](const hal::UncertainParameter& p) { return p.name == parameter; });
  };
  EXPECT_TRUE(reports("separable", "plant_separable"));
  EXPECT_FALSE(reports("separable", "plant_general"));
  EXPECT_TRUE(reports("general", "plant_general"));
  EXPECT_TRUE(reports("general", "friction_load_exponent"));
}

class GeneralRig : public testing::TestWithParam<std::string> {
 protected:
  static std::vector<double> stroke(const std::string& object, std::uint64_t seed) {
    VirtualRig rig({.object = object, .plant = "general", .seed = seed},
                   {.kind = HandProgram::Kind::kStroke, .repetitions = -1});
    std::vector<double> values;
    double command_n = 0.0;
    for (int i = 0; i < 4000; ++i) {
      rig.tick({0.1 * command_n, 0.0, command_n});
      command_n = 0.3 * rig.sample().sensor_force_n.z;
      values.insert(values.end(), {rig.truth().tip_position_mm.x, rig.truth().tip_position_mm.z,
                                   rig.truth().normal_force_n, rig.truth().friction_force_n});
    }
    return values;
  }
};
INSTANTIATE_TEST_SUITE_P(Objects, GeneralRig, testing::ValuesIn(object_preset_names()),
                         [](const auto& tested) { return tested.param; });

TEST_P(GeneralRig, EqualSeedsGiveEqualBits) {
  const std::vector<double> values = stroke(GetParam(), 3);
  EXPECT_EQ(values, stroke(GetParam(), 3));
  EXPECT_NE(values, stroke(GetParam(), 4));
  for (const double value : values) ASSERT_TRUE(std::isfinite(value));
}

TEST_P(GeneralRig, IsPressedAndLetGo) {
  // Friction is the load's, with an exponent below 1, and after the press there is no force left.
  VirtualRig rig({.object = GetParam(), .plant = "general"},
                 {.kind = HandProgram::Kind::kPress, .force_n = 2.0, .hold_s = 0.5, .repetitions = 1});
  double largest_n = 0.0;
  rig.run(12.0, [&] { largest_n = std::max(largest_n, rig.truth().normal_force_n); });
  EXPECT_GT(largest_n, 1.5);
  EXPECT_LT(largest_n, 6.0);
  EXPECT_FALSE(rig.truth().in_contact);
  EXPECT_EQ(rig.truth().normal_force_n, 0.0);
  EXPECT_EQ(rig.truth().friction_force_n, 0.0);
}

TEST(Plant, ObjectsPutUnderTheToolLaterAreOfTheSameFamily) {
  VirtualRig first({.object = "foam_ball", .plant = "general"},
                   {.kind = HandProgram::Kind::kTap, .repetitions = -1});
  VirtualRig later({.object = "none", .plant = "general"}, {.kind = HandProgram::Kind::kRest});
  VirtualRig other({.object = "foam_ball"}, {.kind = HandProgram::Kind::kTap, .repetitions = -1});
  later.set_object("foam_ball");
  later.set_program({.kind = HandProgram::Kind::kTap, .repetitions = -1});
  double first_n = 0.0, later_n = 0.0, other_n = 0.0;
  first.run(3.0, [&] { first_n = std::max(first_n, first.truth().normal_force_n); });
  later.run(3.0, [&] { later_n = std::max(later_n, later.truth().normal_force_n); });
  other.run(3.0, [&] { other_n = std::max(other_n, other.truth().normal_force_n); });
  EXPECT_NEAR(later_n, first_n, 0.02 * first_n);
  EXPECT_GT(std::abs(other_n - first_n), 0.02 * first_n);
}

}  // namespace
}  // namespace hapticd::sim
