#include <gtest/gtest.h>

#include "hd_bench.h"

namespace hapticd::test {
namespace {

/// Two devices of one library: one scheduler, one stack of errors.
class OpenHapticsTwoDevices : public testing::Test {
 protected:
  OpenHapticsTwoDevices() {
    OpenHapticsConfig second = bench.config;
    second.device_name = "Second Device";
    other = std::move(*OpenHapticsDevice::create(second));
    other_body = std::make_unique<Body>(*other);
  }
  ~OpenHapticsTwoDevices() override {
    other_stop = true;
    if (other_runner.joinable()) other_runner.join();
  }
  void run_both() {
    ASSERT_FALSE(bench.device->engage());
    ASSERT_FALSE(other->engage());
    bench.page.set_pose({0.0, 1.0, 0.0}, {}, 0);
    bench.page.set_pose({0.0, 2.0, 0.0}, {}, 1);
    bench.body->ask({0.0, 0.0, 1.0});
    other_body->ask({0.0, 0.0, 2.0});
    bench.start_running();
    other_runner = std::thread([this] { other->run(*other_body, other_stop); });
    ASSERT_TRUE(bench.feels(1.0));
    ASSERT_TRUE(other_feels(2.0));
  }
  bool other_feels(double force_n) {
    return eventually([&] { return std::abs(bench.page.force_n(1).y - force_n) < 1e-9; });
  }
  void stop_other() {
    other_stop = true;
    other_runner.join();
  }

  HdBench bench;
  std::unique_ptr<OpenHapticsDevice> other;
  std::unique_ptr<Body> other_body;
  std::atomic<bool> other_stop{false};
  std::thread other_runner;
};

TEST_F(OpenHapticsTwoDevices, EachHasItsOwnPoseAndForce) {
  run_both();
  for (int i = 0; i < 100; ++i) {
    EXPECT_DOUBLE_EQ(bench.body->sample().tip_position_mm.z, 1.0);
    EXPECT_DOUBLE_EQ(other_body->sample().tip_position_mm.z, 2.0);
    ASSERT_TRUE(bench.ticks(1));
  }
}

TEST_F(OpenHapticsTwoDevices, StoppingOneLeavesTheOtherRunning) {
  run_both();
  stop_other();
  EXPECT_FALSE(bench.page.device(1).force_enabled);
  EXPECT_TRUE(bench.page->scheduler_running);
  other->disengage();
  EXPECT_TRUE(bench.page->loaded);
  EXPECT_TRUE(bench.ticks(50));
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_EQ(bench.body->sample().status, 0U);
  EXPECT_TRUE(bench.leaves_clean());
}

TEST_F(OpenHapticsTwoDevices, AnErrorIsThatOfTheDeviceItNames) {
  run_both();
  bench.body->seen();
  other_body->seen();
  bench.page.device(1).frame_error = 0x0203;
  bench.page.device(1).frame_error_frames = 50;
  EXPECT_TRUE(eventually([&] { return (other_body->seen() & status::kDeviceOverSpeed) != 0; }));
  ASSERT_TRUE(eventually([&] { return bench.page.device(1).frame_error_frames == 0; }));
  ASSERT_TRUE(bench.ticks(5));
  EXPECT_EQ(bench.body->seen() & status::kDeviceOverSpeed, 0U);
  EXPECT_EQ(bench.figure("HD_EXCEEDED_MAX_VELOCITY"), -1.0);
}

TEST_F(OpenHapticsTwoDevices, TheSameDeviceTwiceIsRefused) {
  ASSERT_FALSE(bench.device->engage());
  auto again = std::move(*OpenHapticsDevice::create(bench.config));
  const auto error = again->engage();
  ASSERT_TRUE(error);
  EXPECT_NE(error->text().find("HD_DEVICE_ALREADY_INITIATED"), std::string::npos) << error->text();
  EXPECT_TRUE(bench.page.device(0).open);
}

}  // namespace
}  // namespace hapticd::test
