#include <gtest/gtest.h>

#include "hd_bench.h"

namespace hapticd::test {
namespace {

constexpr std::uint32_t kOk = 0x5000;
constexpr std::uint32_t kNeedsUpdate = 0x5001;
constexpr std::uint32_t kNeedsManualInput = 0x5002;
constexpr int kEncoderReset = 1;
constexpr int kAuto = 2;
constexpr int kInkwell = 4;

/// Engaged but not calibrated: it runs, says so, and gives no force.
void expect_not_ready(HdBench& bench, const std::string& remedy) {
  EXPECT_EQ(bench.device->report().state, hal::PartState::kConnecting);
  EXPECT_TRUE(bench.finds("not calibrated: " + remedy));
  bench.body->ask({0.0, 0.0, 1.0});
  bench.start_running();
  EXPECT_TRUE(bench.sees(status::kDeviceNotReady));
  ASSERT_TRUE(bench.ticks(20));
  EXPECT_EQ(bench.page.device().frames_forced, 0U);
}

TEST(OpenHapticsCalibration, ACalibratedDeviceIsLeftAlone) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
  EXPECT_TRUE(bench.device->report().findings.empty());
  bench.start_running();
  ASSERT_TRUE(bench.ticks(300));
  EXPECT_EQ(bench.page.device().calibration_updates, 0U);
}

TEST(OpenHapticsCalibration, AnAutomaticOneIsDoneWhenEngaging) {
  HdBench bench;
  bench.page.device().calibration_state = kNeedsUpdate;
  bench.page.device().calibration_updates_needed = 3;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.page.device().calibration_updates, 3U);
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
}

TEST(OpenHapticsCalibration, AnAutomaticOneThatTakesLongerIsFinishedWhileRunning) {
  HdBench bench([](OpenHapticsConfig& config) { config.calibration_wait_s = 0.0; });
  bench.page.device().calibration_state = kNeedsUpdate;
  ASSERT_FALSE(bench.device->engage());
  expect_not_ready(bench, "move the arm");
  bench.page.device().calibration_updates_needed = 1;
  EXPECT_TRUE(bench.sees_no(status::kDeviceNotReady));
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
}

TEST(OpenHapticsCalibration, AnInkwellIsWaitedForWhileRunning) {
  HdBench bench;
  bench.page.device().calibration_styles = kInkwell;
  bench.page.device().calibration_state = kNeedsManualInput;
  ASSERT_FALSE(bench.device->engage());
  expect_not_ready(bench, "put the stylus into its inkwell");
  EXPECT_EQ(bench.page.device().calibration_updates, 0U);
  bench.page.device().calibration_updates_needed = 1;
  bench.page.device().calibration_state = kNeedsUpdate;  // the stylus is in
  EXPECT_TRUE(bench.sees_no(status::kDeviceNotReady));
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_EQ(bench.page.device().calibration_updates, 1U);
}

TEST(OpenHapticsCalibration, EncodersAreResetOnlyIfTheConfigurationSaysSo) {
  {
    HdBench bench;
    bench.page.device().calibration_styles = kEncoderReset;
    bench.page.device().calibration_state = kNeedsManualInput;
    bench.page.device().calibration_updates_needed = 1;
    ASSERT_FALSE(bench.device->engage());
    expect_not_ready(bench, "put the arm into its reset position");
    EXPECT_EQ(bench.page.device().calibration_updates, 0U);
  }
  HdBench bench([](OpenHapticsConfig& config) { config.reset_encoders = true; });
  bench.page.device().calibration_styles = kEncoderReset;
  bench.page.device().calibration_state = kNeedsManualInput;
  bench.page.device().calibration_updates_needed = 1;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.page.device().calibration_updates, 1U);
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
}

TEST(OpenHapticsCalibration, AnUncalibratedDeviceIsCalibratedByEngagingItAgain) {
  HdBench bench([](OpenHapticsConfig& config) { config.reset_encoders = true; });
  bench.page.device().calibration_styles = kEncoderReset;
  bench.page.device().calibration_state = kNeedsManualInput;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kConnecting);
  bench.page.device().calibration_updates_needed = 1;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
  bench.page.forget_events();
  ASSERT_FALSE(bench.device->engage());  // engaged already: nothing happens
  EXPECT_TRUE(bench.page.events().empty());
}

TEST(OpenHapticsCalibration, IsNeverUpdatedWhileItMayRender) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page.device().calibration_state = kNeedsUpdate;
  EXPECT_TRUE(eventually([&] { return bench.finds("requests an update of its calibration"); }));
  ASSERT_TRUE(bench.ticks(300));
  EXPECT_EQ(bench.page.device().calibration_updates, 0U);
  EXPECT_TRUE(bench.feels(1.0));
}

TEST(OpenHapticsCalibration, LostWhileRunningItTakesTheForce) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page.device().calibration_state = kNeedsManualInput;
  EXPECT_TRUE(bench.sees(status::kDeviceNotReady));
  EXPECT_TRUE(bench.feels(0.0));
  bench.page.device().calibration_state = kOk;
  EXPECT_TRUE(bench.feels(1.0));
}

}  // namespace
}  // namespace hapticd::test
