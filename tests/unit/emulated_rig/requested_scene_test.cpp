// The scene that does what an identification requests, and when it is the same one as before.

#include "server/identification/palpation/requested_scene.h"

#include <gtest/gtest.h>

#include <functional>

namespace hapticd::server {
namespace {

TEST(RequestedScene, IsLoadedAgainOnlyWhereTheDeviceIsToDoSomethingElse) {
  hal::RigInfo rig;
  rig.sensor.tool_mass_g = 9.35;
  identification::MotionRequest request;
  EXPECT_FALSE(requested_scene(request, rig)) << "nothing is to be done";
  request.device = identification::MotionRequest::Device::kModulation;
  request.stiffness_n_per_mm = 1.0;
  request.proportional_gain = 0.6;
  request.derivative_ms = 2.0;
  request.max_device_force_n = 4.0;
  const rt::SceneSpec before = *requested_scene(request, rig);
  const auto same_after = [&](const std::function<void(identification::MotionRequest&)>& change) {
    identification::MotionRequest other = request;
    change(other);
    return renders_the_same(before, *requested_scene(other, rig));
  };
  // What a hand does meanwhile does not concern the device.
  EXPECT_TRUE(same_after(
      [](identification::MotionRequest& w) { w.words = "once more", w.force_n = 3.0, w.hold_s = 2.0; }));
  EXPECT_FALSE(same_after([](identification::MotionRequest& w) { w.stiffness_n_per_mm = 1.1; }));
  EXPECT_FALSE(same_after([](identification::MotionRequest& w) { w.proportional_gain = 0.7; }));
  EXPECT_FALSE(same_after([](identification::MotionRequest& w) { w.derivative_ms = 1.0; }));
  EXPECT_FALSE(same_after([](identification::MotionRequest& w) { w.max_device_force_n = 5.0; }));
  EXPECT_FALSE(same_after([](identification::MotionRequest& w) { w.encoders_as_they_are = true; }));
  EXPECT_FALSE(same_after(
      [](identification::MotionRequest& w) { w.device = identification::MotionRequest::Device::kWall; }));
  request.device = identification::MotionRequest::Device::kWall;
  const rt::SceneSpec wall = *requested_scene(request, rig);
  request.place_mm.z = 70.0;
  EXPECT_FALSE(renders_the_same(wall, *requested_scene(request, rig))) << "a wall elsewhere";
}

}  // namespace
}  // namespace hapticd::server
