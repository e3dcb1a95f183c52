#include <gtest/gtest.h>

#include "hal/openhaptics/hd_errors.h"
#include "hd_bench.h"

namespace hapticd::test {
namespace {

struct Reported {
  std::uint32_t code;
  const char* name;
  std::uint32_t bit;
  friend void PrintTo(const Reported& reported, std::ostream* out) { *out << reported.name; }
};

class OpenHapticsErrors : public testing::TestWithParam<Reported> {};

TEST_P(OpenHapticsErrors, ComesWithItsBitItsNameAndItsCount) {
  const Reported& reported = GetParam();
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.body->seen();
  bench.page.device().frame_error = reported.code;
  bench.page.device().frame_error_burst = 2;
  bench.page.device().frame_error_frames = 1;
  EXPECT_TRUE(eventually([&] { return (bench.body->seen() & reported.bit) != 0; }));
  EXPECT_TRUE(eventually([&] { return bench.figure(reported.name) == 2.0; }));
  EXPECT_TRUE(bench.finds(reported.name));
  EXPECT_TRUE(bench.sees_no(reported.bit));  // when it is over, it is over
  EXPECT_TRUE(bench.feels(1.0));
}

INSTANTIATE_TEST_SUITE_P(
    Published, OpenHapticsErrors,
    testing::Values(Reported{0x0200, "HD_WARM_MOTORS", status::kDeviceWarm},
                    Reported{0x0201, "HD_EXCEEDED_MAX_FORCE", status::kDeviceOverForce},
                    Reported{0x0202, "HD_EXCEEDED_MAX_FORCE_IMPULSE", status::kDeviceOverForce},
                    Reported{0x0203, "HD_EXCEEDED_MAX_VELOCITY", status::kDeviceOverSpeed},
                    Reported{0x0204, "HD_FORCE_ERROR", status::kDeviceFault},
                    Reported{0x0300, "HD_DEVICE_FAULT", status::kDeviceFault},
                    Reported{0x0302, "HD_COMM_ERROR", status::kDeviceFault},
                    Reported{0x0304, "HD_TIMER_ERROR", status::kDeviceFault},
                    Reported{0x0402, "HD_FRAME_ERROR", status::kDeviceFault},
                    Reported{0x0104, "HD_BAD_HANDLE", status::kDeviceFault},
                    Reported{0x7777, "unknown HD error", status::kDeviceFault}),
    [](const auto& reported) { return "Code" + std::to_string(reported.param.code); });

TEST(OpenHapticsFaults, EveryErrorHasANameABitAndARemedy) {
  for (const openhaptics::HdError& error : openhaptics::hd_errors()) {
    EXPECT_FALSE(error.name.empty());
    EXPECT_NE(error.status, 0U) << error.name;
    EXPECT_FALSE(error.remedy.empty()) << error.name;
  }
}

TEST(OpenHapticsFaults, FromTheFaultToNoForceItTakesOneTick) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  const std::uint64_t before = bench.page.device().frames_forced;
  const std::uint64_t frames_before = bench.page.device().frames;
  bench.page.device().frame_error = 0x0300;
  bench.page.device().frame_error_frames = 20;
  ASSERT_TRUE(eventually([&] { return bench.page.device().frame_error_frames == 0; }));
  // One of the twenty frames with the fault was under way when it came up; the others had no force.
  const std::uint64_t forced = bench.page.device().frames_forced - before;
  const std::uint64_t frames = bench.page.device().frames - frames_before;
  EXPECT_GE(frames, 20U);
  EXPECT_LE(forced + 19, frames);
}

TEST(OpenHapticsFaults, AStackWithoutAnEndIsAFaultAndNoTrap) {
  HdBench bench;
  ASSERT_TRUE(bench.runs(5));
  bench.page.device().frame_error = 0x0200;
  bench.page.device().frame_error_burst = 1000;
  bench.page.device().frame_error_frames = 10;
  EXPECT_TRUE(bench.sees(status::kDeviceFault));
  EXPECT_TRUE(eventually([&] { return bench.figure("error_stacks_overfull") >= 1.0; }));
  EXPECT_TRUE(bench.ticks(20));
  EXPECT_TRUE(bench.sees_no(status::kDeviceFault));
}

TEST(OpenHapticsFaults, UnpluggedWhileRendering) {
  HdBench bench;
  bench.page.set_pose({0.0, 7.0, 0.0}, {});
  ASSERT_TRUE(bench.renders(1.0));
  bench.page.device().unplugged = true;
  EXPECT_TRUE(bench.sees(status::kDeviceFault));
  EXPECT_TRUE(bench.feels(0.0));
  EXPECT_DOUBLE_EQ(bench.body->sample().tip_position_mm.z, 7.0);
  EXPECT_TRUE(bench.finds("HD_COMM_ERROR"));
  EXPECT_TRUE(bench.finds("check cable and power"));
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
  EXPECT_TRUE(bench.ticks(50));  // the clock ticks on
  bench.stop_running();

  // Plugged in again it is opened again.
  bench.page.device().unplugged = false;
  bench.page.forget_events();
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.page.events().front(), HdEvent::kForceOff);
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
  bench.start_running();
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_TRUE(bench.leaves_clean());
}

TEST(OpenHapticsFaults, NoDevice) {
  HdBench bench;
  bench.page.device().init_error = 0x0300;
  auto error = bench.device->engage();
  ASSERT_TRUE(error);
  EXPECT_NE(error->text().find("HD_DEVICE_FAULT (0x300"), std::string::npos) << error->text();
  EXPECT_FALSE(error->remedy.empty());
  EXPECT_TRUE(bench.left_clean());
  EXPECT_TRUE(bench.finds("HD_DEVICE_FAULT"));

  bench.page.device().init_error = 0;
  bench.page.device().init_fails_silently = true;
  error = bench.device->engage();
  ASSERT_TRUE(error);
  EXPECT_NE(error->text().find("no handle"), std::string::npos) << error->text();
  EXPECT_TRUE(bench.left_clean());

  bench.page.device().init_fails_silently = false;
  EXPECT_FALSE(bench.device->engage());
  EXPECT_TRUE(bench.device->report().findings.empty());
}

TEST(OpenHapticsFaults, WarmWhenOpenedIsNoReasonNotTo) {
  HdBench bench;
  bench.page.device().init_error = 0x0200;
  EXPECT_FALSE(bench.device->engage());
}

// Hang of the library: the users of it must not hang with it. These end a process's use of the library, so
// each has a separate one.
class OpenHapticsHang : public testing::Test {
 protected:
  /// Whether the body of a test passes in a child process, whose library is then its own.
  static void in_a_process_of_its_own(const std::function<void()>& body) {
    testing::FLAGS_gtest_death_test_style = "fast";
    EXPECT_EXIT(
        {
          body();
          // The hanging thread would outlive everything: leave without tidying up.
          std::_Exit(testing::Test::HasFailure() ? 1 : 0);
        },
        testing::ExitedWithCode(0), "");
  }
};

TEST_F(OpenHapticsHang, OpeningTheDevice) {
  in_a_process_of_its_own([] {
    HdBench bench([](OpenHapticsConfig& config) { config.timeout_s = 0.2; });
    bench.page->init_hangs_ms = 1000;
    const auto error = bench.device->engage();
    ASSERT_TRUE(error);
    EXPECT_NE(error->text().find("does not return"), std::string::npos) << error->text();
    EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
    // When it does come back, it is closed.
    EXPECT_TRUE(eventually([&] { return bench.left_clean(); }));
    bench.page->init_hangs_ms = 0;
    EXPECT_FALSE(bench.device->engage());
  });
}

TEST_F(OpenHapticsHang, StoppingTheScheduler) {
  in_a_process_of_its_own([] {
    HdBench bench;
    ASSERT_TRUE(bench.renders(1.0));
    bench.page->stop_hangs_ms = 60'000;
    bench.stop_running();
    EXPECT_FALSE(bench.page.device().force_enabled);  // by the last frame
    EXPECT_EQ(bench.page.device().force_n[1], 0.0);
    EXPECT_TRUE(bench.finds("does not return from stopping the scheduler"));
    EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
    const auto error = bench.device->engage();
    ASSERT_TRUE(error);
    EXPECT_NE(error->text().find("restart the service"), std::string::npos) << error->text();
    EXPECT_TRUE(bench.page->loaded);  // never unloaded under the thread that hangs in it
    bench.device->disengage();
  });
}

TEST_F(OpenHapticsHang, AFrame) {
  in_a_process_of_its_own([] {
    HdBench bench;
    ASSERT_TRUE(bench.renders(1.0));
    bench.page->frame_hangs_ms = 3000;
    ASSERT_TRUE(eventually([&] { return bench.page->frame_hangs_ms == 0; }));
    bench.stop_running();
    const std::uint64_t calls = bench.body->calls();
    EXPECT_FALSE(bench.page.device().force_enabled);
    EXPECT_TRUE(bench.finds("does not return"));
    // When it comes back it finds no device, leaves no force and does not touch what is gone.
    bench.device = nullptr;
    EXPECT_TRUE(eventually([&] { return bench.page.device().force_n[1] == 0.0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(bench.body->calls(), calls);
  });
}

}  // namespace
}  // namespace hapticd::test
