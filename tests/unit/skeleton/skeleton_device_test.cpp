#include "hal/skeleton/skeleton_device.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <mutex>
#include <thread>

#include "../allocation_counter.h"

namespace hapticd::skeleton {
namespace {

namespace status = hal::sample_status;

/// A device that is a few variables; the test keeps them when the driver is gone.
struct FakeDevice {
  std::mutex mutex;
  bool answers = true;
  bool open = false;
  hal::Vector3 position_mm{1.0, 2.0, 3.0};
  hal::Vector3 force_n{9.0, 9.0, 9.0};

  hal::Vector3 force_now_n() {
    const std::lock_guard lock(mutex);
    return force_n;
  }
};

class FakeLink final : public DeviceLink {
 public:
  explicit FakeLink(FakeDevice& device) : device_(device) {}
  bool open() override { return device_.open = device_.answers; }
  void close() noexcept override { device_.open = false; }
  bool read_position(hal::Vector3& position_mm) noexcept override {
    position_mm = device_.position_mm;
    return device_.answers;
  }
  bool write_force(const hal::Vector3& force_n) noexcept override {
    const std::lock_guard lock(device_.mutex);
    if (device_.answers) device_.force_n = force_n;
    return device_.answers;
  }

 private:
  FakeDevice& device_;
};

class Skeleton : public testing::Test {
 protected:
  explicit Skeleton(double watchdog_ms = 1000.0) {
    hal::DeviceInfo info{.model = "skeleton", .max_force_n = 8.0};
    driver = std::move(*SkeletonDevice::create(info, watchdog_ms, std::make_unique<FakeLink>(device)));
  }
  void engage() { ASSERT_FALSE(driver->engage().has_value()); }
  /// One tick: what the driver reports, then a force along x.
  std::uint32_t tick(double force_n) {
    sample = {};
    driver->read(sample);
    driver->write({{force_n, 0.0, 0.0}});
    return sample.status;
  }

  FakeDevice device;
  std::unique_ptr<SkeletonDevice> driver;
  hal::RigSample sample;
};

class HastySkeleton : public Skeleton {
 protected:
  HastySkeleton() : Skeleton(2.0) {}
};

TEST_F(Skeleton, OpensNothingUntilItIsEngaged) {
  EXPECT_FALSE(device.open);
  EXPECT_EQ(tick(1.0), status::kDeviceNotReady);
  EXPECT_EQ(driver->report().state, hal::PartState::kIdle);
  engage();
  EXPECT_TRUE(device.open);
  EXPECT_EQ(device.force_now_n().x, 0.0) << "a force that the device still held";
  EXPECT_EQ(driver->report().state, hal::PartState::kReady);
}

TEST_F(Skeleton, ADeviceThatDoesNotAnswerIsRefusedWithTheRemedy) {
  device.answers = false;
  const auto error = driver->engage();
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->text(), "haptic device: no device answers (got skeleton); check its cable and its supply");
}

TEST_F(Skeleton, PositionComesInAndForceGoesOut) {
  engage();
  EXPECT_EQ(tick(2.5), 0U);
  EXPECT_EQ(sample.tip_position_mm.z, 3.0);
  EXPECT_EQ(device.force_now_n().x, 2.5);
}

TEST_F(Skeleton, UnpluggedItReportsAFaultKeepsThePoseAndComesBackWithoutForce) {
  engage();
  tick(2.5);
  device.answers = false;
  device.position_mm = {50.0, 50.0, 50.0};
  EXPECT_EQ(tick(2.5), status::kDeviceFault);
  EXPECT_EQ(sample.tip_position_mm.z, 3.0);
  EXPECT_EQ(driver->report().state, hal::PartState::kFaulty);
  EXPECT_EQ(driver->report().findings.size(), 1U);
  device.answers = true;
  EXPECT_EQ(tick(2.5), status::kDeviceFault) << "the last force was not taken";
  EXPECT_EQ(device.force_now_n().x, 0.0);
  EXPECT_EQ(tick(2.5), 0U);
  EXPECT_EQ(device.force_now_n().x, 2.5);
}

TEST_F(Skeleton, WhatIsNotANumberGivesNoForce) {
  engage();
  tick(2.5);
  tick(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(device.force_now_n().x, 0.0);
  device.position_mm.y = std::numeric_limits<double>::infinity();
  EXPECT_EQ(tick(2.5), status::kDeviceFault);
  EXPECT_EQ(sample.tip_position_mm.y, 2.0);
  EXPECT_EQ(device.force_now_n().x, 0.0);
}

TEST_F(Skeleton, AForceBeyondTheLimitIsScaledAndReported) {
  engage();
  tick(8.0);
  EXPECT_EQ(tick(20.0), 0U) << "the limit itself is no excess";
  EXPECT_EQ(device.force_now_n().x, 8.0);
  EXPECT_EQ(tick(1.0), status::kDeviceOverForce);
  EXPECT_EQ(tick(1.0), 0U);
}

TEST_F(HastySkeleton, WithoutCommandsTheForceEndsAndTheNextReadReportsIt) {
  engage();
  tick(2.5);
  while (device.force_now_n().x != 0.0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(tick(0.0) & status::kCommandStale);
}

TEST_F(Skeleton, ACrashWritesZeroAndNothingElseFollows) {
  engage();
  tick(2.5);
  driver->write_zero_in_crash();
  EXPECT_EQ(device.force_now_n().x, 0.0);
  tick(2.5);
  EXPECT_EQ(device.force_now_n().x, 0.0);
}

TEST_F(Skeleton, ItLetsGoOfTheDeviceWithoutForce) {
  engage();
  tick(2.5);
  driver->disengage();
  EXPECT_EQ(device.force_now_n().x, 0.0);
  EXPECT_FALSE(device.open);
  EXPECT_EQ(tick(2.5), status::kDeviceNotReady);
}

TEST_F(Skeleton, ReadAndWriteAllocateNothing) {
  engage();
  tick(1.0);
  const auto before = test::allocations();
  for (int i = 0; i < 1000; ++i) tick(1.0);
  EXPECT_EQ(test::allocations(), before);
}

TEST(SkeletonValues, OutOfRangeTheyAreRefusedByName) {
  FakeDevice device;
  hal::DeviceInfo info;
  info.max_force_n = 8.0;
  const auto hasty = SkeletonDevice::create(info, 0.5, std::make_unique<FakeLink>(device));
  ASSERT_FALSE(hasty);
  EXPECT_EQ(hasty.error().where, "[rig.skeleton] watchdog_ms");
  info.max_force_n = 0.0;
  const auto weak = SkeletonDevice::create(info, 20.0, std::make_unique<FakeLink>(device));
  ASSERT_FALSE(weak);
  EXPECT_EQ(weak.error().where, "[rig.skeleton] max_force_n");
}

}  // namespace
}  // namespace hapticd::skeleton
