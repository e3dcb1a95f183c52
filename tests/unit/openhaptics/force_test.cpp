#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "hd_bench.h"

namespace hapticd::test {
namespace {

double magnitude(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

TEST(OpenHapticsForce, LimitsAreReadFromTheDevice) {
  HdBench bench;
  bench.page.device().max_force_n = 3.3;
  bench.page.device().max_continuous_force_n = 0.88;
  bench.page.device().max_stiffness_n_per_mm = 0.5;
  EXPECT_DOUBLE_EQ(bench.device->info().max_force_n, 8.5);  // of the data sheet
  ASSERT_FALSE(bench.device->engage());
  EXPECT_DOUBLE_EQ(bench.device->info().max_force_n, 3.3);
  EXPECT_DOUBLE_EQ(bench.device->info().max_continuous_force_n, 0.88);
  EXPECT_DOUBLE_EQ(bench.figure("device_max_stiffness"), 0.5);
  EXPECT_DOUBLE_EQ(bench.figure("force_limit"), 3.3);
  EXPECT_DOUBLE_EQ(bench.figure("force_ramping"), 1.0);
  EXPECT_DOUBLE_EQ(bench.figure("max_force_clamping"), 0.0);
  EXPECT_DOUBLE_EQ(bench.figure("force_ramping_rate"), 2000.0);
}

TEST(OpenHapticsForce, IsZeroForGoodOnceACrashAsksForIt) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(2.0));
  bench.device->write_zero_in_crash();
  EXPECT_EQ(magnitude(bench.page.force_n()), 0.0) << "at once, not some time later";
  bench.body->ask({0.0, 0.0, 3.0});
  ASSERT_TRUE(bench.ticks(20));
  EXPECT_EQ(magnitude(bench.page.force_n()), 0.0);
  EXPECT_TRUE(bench.leaves_clean());
}

/// Crashes in a tick: the scheduler's own thread is the one that handles it, and comes back to no other
/// frame.
class CrashingBody final : public hal::ServoBody {
 public:
  CrashingBody(HdBench& bench) : bench_(bench) {}
  void on_servo() noexcept override {
    hal::RigSample sample;
    bench_.device->read(sample);
    bench_.device->write({{0.0, 0.0, 2.0}});
    if (++calls_ < 50) return;
    if (calls_ == 50) {
      before_n_ = magnitude(bench_.page.force_n());
      bench_.device->write_zero_in_crash();
      after_n_ = magnitude(bench_.page.force_n());
    }
    bench_.stop = true;
  }
  double before_n() const { return before_n_; }
  double after_n() const { return after_n_; }

 private:
  HdBench& bench_;
  int calls_ = 0;
  double before_n_ = -1.0;
  double after_n_ = -1.0;
};

TEST(OpenHapticsForce, IsZeroAlsoWhereTheTickItselfCrashes) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  CrashingBody body(bench);
  bench.stop = false;
  bench.device->run(body, bench.stop);
  EXPECT_NEAR(body.before_n(), 2.0, 1e-9);
  EXPECT_EQ(body.after_n(), 0.0);
}

TEST(OpenHapticsForce, ALowerLimitOfTheConfigurationHoldsAHigherOneDoesNot) {
  HdBench lower([](OpenHapticsConfig& config) { config.max_force_n = 2.0; });
  ASSERT_FALSE(lower.device->engage());
  EXPECT_DOUBLE_EQ(lower.device->info().max_force_n, 2.0);
  EXPECT_FALSE(lower.finds("beyond"));
  lower.device->disengage();
  HdBench higher([](OpenHapticsConfig& config) { config.max_force_n = 20.0; });
  ASSERT_FALSE(higher.device->engage());
  EXPECT_DOUBLE_EQ(higher.device->info().max_force_n, 8.5);
  EXPECT_TRUE(higher.finds("beyond the device's 8.5 N"));
}

TEST(OpenHapticsForce, ALimitThatIsNoneGivesWayToTheDataSheet) {
  for (const double nonsense : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e9}) {
    HdBench bench;
    bench.page.device().max_force_n = nonsense;
    ASSERT_FALSE(bench.device->engage());
    EXPECT_DOUBLE_EQ(bench.device->info().max_force_n, 8.5);
    EXPECT_TRUE(bench.finds("does not show its force limits"));
  }
}

TEST(OpenHapticsForce, TooMuchIsScaledDownInItsDirectionAndReported) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  bench.body->ask({30.0, 0.0, 40.0});
  bench.start_running();
  ASSERT_TRUE(bench.feels(0.8 * 8.5));
  EXPECT_NEAR(magnitude(bench.page.force_n()), 8.5, 1e-9);
  EXPECT_TRUE(bench.sees(status::kDeviceOverForce));
  EXPECT_EQ(bench.figure("HD_EXCEEDED_MAX_FORCE"), -1.0);  // the device itself was not asked for too much
  EXPECT_GE(bench.figure("commands_limited"), 1.0);
  bench.body->ask({0.0, 0.0, 8.5});  // the limit itself is not beyond it
  EXPECT_TRUE(bench.sees_no(status::kDeviceOverForce));
  EXPECT_TRUE(bench.feels(8.5));
}

TEST(OpenHapticsForce, WhatIsNotANumberIsNoForce) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  for (const double nonsense :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    bench.body->ask({nonsense, 0.0, 1.0});
    EXPECT_TRUE(bench.feels(0.0));
    EXPECT_EQ(bench.page.force_n().x, 0.0);
    bench.body->ask({0.0, 0.0, 1.0});
    EXPECT_TRUE(bench.feels(1.0));
  }
  EXPECT_GE(bench.figure("commands_not_finite"), 2.0);
  bench.body->ask({1e300, 1e300, 1e300});  // whose square is not finite
  EXPECT_TRUE(bench.feels(8.5 / std::sqrt(3.0)));
}

TEST(OpenHapticsForce, ATickThatWritesNothingIsOneWithoutForce) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.body->write_nothing();
  EXPECT_TRUE(bench.feels(0.0));
}

TEST(OpenHapticsForce, IsInTheFrameOfTheVeryTickThatAskedForIt) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  /// Asks for the position it reads, in newtons.
  class Echo final : public hal::ServoBody {
   public:
    Echo(hal::HapticDevice& device, emulators::HdPage& page) : device_(device), page_(page) {}
    void on_servo() noexcept override {
      hal::RigSample sample;
      device_.read(sample);
      if (calls > 0 && std::abs(page_.device().force_n[1] - last) > 1e-12) ++misses;
      last = 0.001 * static_cast<double>(calls.load() % 1000);
      device_.write({{0.0, 0.0, last}});
      ++calls;
    }
    std::atomic<int> calls{0}, misses{0};
    double last = 0.0;

   private:
    hal::HapticDevice& device_;
    emulators::HdPage& page_;
  } echo(*bench.device, bench.page);
  std::thread runner([&] { bench.device->run(echo, bench.stop); });
  EXPECT_TRUE(eventually([&] { return echo.calls > 500; }));
  bench.stop = true;
  runner.join();
  EXPECT_EQ(echo.misses, 0);
}

TEST(OpenHapticsForce, ADeviceThatRefusesForceIsNotReady) {
  HdBench bench;
  bench.page.device().refuses_force = true;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_TRUE(bench.finds("accepts no force"));
  bench.body->ask({0.0, 0.0, 1.0});
  bench.start_running();
  EXPECT_TRUE(bench.sees(status::kDeviceNotReady));
  bench.stop_running();
  bench.page.device().refuses_force = false;
  bench.start_running();
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_TRUE(eventually([&] { return !bench.finds("accepts no force"); }))
      << "reported within a tick of the force";
}

TEST(OpenHapticsForce, AnOutputSwitchedOffWhileRunningStaysOffUntilTheNextRun) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page.device().force_enabled = false;  // by the library itself
  EXPECT_TRUE(bench.sees(status::kDeviceNotReady));
  EXPECT_TRUE(bench.finds("accepts no force"));
  ASSERT_TRUE(bench.ticks(200));
  EXPECT_FALSE(bench.page.device().force_enabled);
  bench.stop_running();
  bench.start_running();
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_EQ(bench.body->sample().status, 0U);
}

TEST(OpenHapticsForce, MotorTemperaturesAreReportedAndWarmOnesWarnOf) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  bench.body->ask({0.0, 0.0, 1.0});
  bench.start_running();
  EXPECT_TRUE(eventually([&] { return bench.figure("motor_3_temperature") == 0.2; }));
  bench.page.device().motor_temperature[1] = 0.95;
  EXPECT_TRUE(bench.sees(status::kDeviceWarm));
  EXPECT_TRUE(bench.finds("motor 2 is at 95 %"));
  EXPECT_TRUE(bench.feels(1.0));  // what follows from it is not the driver's to decide
  bench.page.device().motor_temperature[1] = 0.3;
  EXPECT_TRUE(bench.sees_no(status::kDeviceWarm));
}

TEST(OpenHapticsForce, ReportsItsAngles) {
  HdBench bench;
  bench.page.set_angles({0.1, -0.2, 0.3}, {0.4, -0.5, 0.6});
  ASSERT_FALSE(bench.device->engage());
  bench.start_running();
  ASSERT_TRUE(eventually([&] { return bench.body->sample().angles.known; }));
  EXPECT_EQ(bench.body->sample().angles.joint_rad, (std::array<double, 3>{0.1, -0.2, 0.3}));
  EXPECT_EQ(bench.body->sample().angles.gimbal_rad, (std::array<double, 3>{0.4, -0.5, 0.6}));
  bench.page.set_angles({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, {});
  EXPECT_TRUE(eventually([&] { return !bench.body->sample().angles.known; }));
  EXPECT_EQ(bench.body->seen() & status::kDeviceFault, 0U) << "the pose does not come from them";
}

TEST(OpenHapticsForce, ADeviceWithoutAnglesIsNotAtFault) {
  HdBench bench;
  ASSERT_TRUE(bench.runs(50));
  EXPECT_FALSE(bench.body->sample().angles.known);
  EXPECT_EQ(bench.body->seen() & status::kDeviceFault, 0U);
}

TEST(OpenHapticsForce, ADeviceWithoutTemperaturesIsNotAtFault) {
  HdBench bench;
  bench.page.device().lacks_temperature = true;
  bench.body->ask({0.0, 0.0, 1.0});
  ASSERT_TRUE(bench.runs(300));
  EXPECT_EQ(bench.body->seen() & (status::kDeviceFault | status::kDeviceWarm), 0U);
  EXPECT_EQ(bench.figure("motor_1_temperature"), -1.0);
  EXPECT_TRUE(bench.feels(1.0));
}

}  // namespace
}  // namespace hapticd::test
