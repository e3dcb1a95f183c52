#include "hal/axis_map.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/support/value_of.h"

namespace hapticd::hal {
namespace {

void expect_vector(const Vector3& got, const Vector3& wanted) {
  EXPECT_EQ(got.x, wanted.x);
  EXPECT_EQ(got.y, wanted.y);
  EXPECT_EQ(got.z, wanted.z);
}

TEST(AxisMap, NamesTheSensorsAxisForEachOfTheTools) {
  struct Case {
    AxisMap map;
    Vector3 tool;  ///< of (1, 2, 3) at the sensor
    const char* text;
  };
  for (const Case& c : {Case{{}, {1.0, 2.0, 3.0}, "+x +y +z"},
                        Case{test::value_of(AxisMap::parse("+y -x +z", "")), {2.0, -1.0, 3.0}, "+y -x +z"},
                        Case{test::value_of(AxisMap::parse("yzx", "")), {2.0, 3.0, 1.0}, "+y +z +x"}}) {
    expect_vector(c.map.to_tool({1.0, 2.0, 3.0}), c.tool);
    EXPECT_EQ(c.map.text(), c.text);
  }
}

/// Exactly the 24 rotations of the 48 signed permutations are mountings.
TEST(AxisMap, AcceptsTheTwentyFourQuarterTurnsAndNoMirrorImage) {
  const std::array<std::string, 6> orders{"xyz", "yzx", "zxy", "xzy", "zyx", "yxz"};
  int accepted = 0;
  for (const std::string& order : orders) {
    for (int signs = 0; signs < 8; ++signs) {
      std::string text;
      for (std::size_t i = 0; i < 3; ++i) {
        text += (signs >> i & 1) != 0 ? '-' : '+';
        text += order[i];
      }
      const auto map = AxisMap::parse(text, "here");
      if (!map) continue;
      ++accepted;
      // A rotation keeps the cross product of two vectors.
      const Vector3 a = map->to_tool({1.0, 0.0, 0.0});
      const Vector3 b = map->to_tool({0.0, 1.0, 0.0});
      const Vector3 cross{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
      expect_vector(cross, map->to_tool({0.0, 0.0, 1.0}));
    }
  }
  EXPECT_EQ(accepted, 24);
}

TEST(AxisMap, RefusesWhatIsNoMounting) {
  for (const char* text :
       {"", "+x +y", "+x +x +z", "+x +y +w", "+x +y +z +x", "+x +y -z", "x y +", "+-x y z"}) {
    const auto map = AxisMap::parse(text, "[rig.netft] axes");
    ASSERT_FALSE(map) << text;
    EXPECT_EQ(map.error().where, "[rig.netft] axes");
    EXPECT_FALSE(map.error().remedy.empty());
  }
}

}  // namespace
}  // namespace hapticd::hal
