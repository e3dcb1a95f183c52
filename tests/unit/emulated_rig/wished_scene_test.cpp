// The scene that does what an identification wishes, and when it is the same one as before.

#include <gtest/gtest.h>

#include <functional>

#include "server/identification/palpation/requested_scene.h"

namespace hapticd::server {
namespace {

TEST(WishedScene, IsLoadedAgainOnlyWhereTheDeviceIsToDoSomethingElse) {
  hal::RigInfo rig;
  rig.sensor.tool_mass_g = 9.35;
  rt::Wish wish;
  EXPECT_FALSE(wished_scene(wish, rig)) << "nothing is to be done";
  wish.device = rt::Wish::Device::kModulation;
  wish.stiffness_n_per_mm = 1.0;
  wish.proportional_gain = 0.6;
  wish.derivative_ms = 2.0;
  wish.max_device_force_n = 4.0;
  const rt::SceneSpec before = *wished_scene(wish, rig);
  const auto same_after = [&](const std::function<void(rt::Wish&)>& change) {
    rt::Wish other = wish;
    change(other);
    return renders_the_same(before, *wished_scene(other, rig));
  };
  // What a hand does meanwhile is no matter of the device.
  EXPECT_TRUE(same_after([](rt::Wish& w) { w.words = "once more", w.force_n = 3.0, w.hold_s = 2.0; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.stiffness_n_per_mm = 1.1; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.proportional_gain = 0.7; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.derivative_ms = 1.0; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.max_device_force_n = 5.0; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.encoders_as_they_are = true; }));
  EXPECT_FALSE(same_after([](rt::Wish& w) { w.device = rt::Wish::Device::kWall; }));
  wish.device = rt::Wish::Device::kWall;
  const rt::SceneSpec wall = *wished_scene(wish, rig);
  wish.place_mm.z = 70.0;
  EXPECT_FALSE(renders_the_same(wall, *wished_scene(wish, rig))) << "a wall elsewhere";
}

}  // namespace
}  // namespace hapticd::server
