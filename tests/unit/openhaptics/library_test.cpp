#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hd_bench.h"

namespace hapticd::test {
namespace {

hal::Error refused(HdBench& bench) {
  auto error = bench.device->engage();
  EXPECT_TRUE(error);
  EXPECT_FALSE(bench.page->loaded);
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
  return error.value_or(hal::Error{});
}

TEST(OpenHapticsLibrary, ThatIsNowhereIsNamedWithAllThatWasTried) {
  HdBench bench([](OpenHapticsConfig& config) {
    config.vendor_library_names = "libHD_nowhere.so, /nowhere/libHD_either.so";
  });
  const hal::Error error = refused(bench);
  EXPECT_NE(error.text().find("libHD_nowhere.so"), std::string::npos) << error.text();
  EXPECT_NE(error.text().find("/nowhere/libHD_either.so"), std::string::npos) << error.text();
  EXPECT_NE(error.remedy.find("install OpenHaptics"), std::string::npos);
}

TEST(OpenHapticsLibrary, ThatIsNoneIsAnError) {
  TemporaryFolder folder;
  const std::string path = folder.write("libHD.so", std::string(4096, 'x'));
  HdBench bench([&](OpenHapticsConfig& config) { config.vendor_library_names = path; });
  EXPECT_NE(refused(bench).text().find("invalid ELF header"), std::string::npos);
  HdBench empty(
      [&](OpenHapticsConfig& config) { config.vendor_library_names = folder.write("empty.so", ""); });
  EXPECT_NE(refused(empty).text().find("file too short"), std::string::npos);
}

TEST(OpenHapticsLibrary, ThatLacksAFunctionIsAnErrorThatNamesIt) {
  HdBench bench([](OpenHapticsConfig& config) { config.vendor_library_names = stand_in("_incomplete"); });
  const hal::Error error = refused(bench);
  EXPECT_EQ(error.value, "hdSetDoublev");
  EXPECT_NE(error.where.find("libHD_stand_in_incomplete.so"), std::string::npos);
  EXPECT_FALSE(error.remedy.empty());
}

TEST(OpenHapticsLibrary, AnyOtherLibraryIsAnErrorToo) {
  HdBench bench([](OpenHapticsConfig& config) { config.vendor_library_names = "libm.so.6"; });
  EXPECT_EQ(refused(bench).value, "hdInitDevice");
}

TEST(OpenHapticsLibrary, TheFirstThatWillDoIsTaken) {
  HdBench bench([](OpenHapticsConfig& config) {
    config.vendor_library_names =
        "libHD_nowhere.so," + stand_in("_incomplete") + " , " + stand_in() + ", libm.so.6";
  });
  ASSERT_FALSE(bench.device->engage());
  EXPECT_NE(bench.device->report().connection.find("libHD_stand_in.so"), std::string::npos);
}

TEST(OpenHapticsLibrary, WithoutAnyOfTheOptionalFunctionsItRuns) {
  HdBench bench([](OpenHapticsConfig& config) { config.vendor_library_names = stand_in("_bare"); });
  ASSERT_FALSE(bench.device->engage());
  EXPECT_TRUE(bench.finds("taken as such"));
  bench.body->ask({0.0, 0.0, 1.0});
  bench.start_running();
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_TRUE(bench.leaves_clean());
}

TEST(OpenHapticsLibrary, IsUnloadedAndLoadedAgain) {
  HdBench bench;
  for (int round = 0; round < 20; ++round) {
    ASSERT_FALSE(bench.device->engage());
    EXPECT_TRUE(bench.page->loaded);
    bench.device->disengage();
    EXPECT_TRUE(bench.left_clean());
  }
}

TEST(OpenHapticsLibrary, WhatTheDeviceSaysOfItselfIsReportedAndAHighForceModelPointedElsewhere) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_NE(bench.device->report().connection.find("Stand-in PHANTOM 1.5 0815, driver 4.2.0, 1000 Hz"),
            std::string::npos)
      << bench.device->report().connection;
  EXPECT_FALSE(bench.finds("High Force"));
  bench.device->disengage();
  std::snprintf(bench.page.device().model_type, sizeof bench.page.device().model_type,
                "PHANTOM 1.5 High Force");
  ASSERT_FALSE(bench.device->engage());
  EXPECT_TRUE(bench.finds("hal/phantom"));
}

TEST(OpenHapticsLibrary, ThePageIsSharedBetweenProcesses) {
  HdBench bench;
  // The world's end in another process, as an emulator is.
  const pid_t child = fork();
  if (child == 0) {
    HdPage world(bench.page.path(), HdPage::Join{});
    for (int i = 0; i < 10'000 && world.force_n().y < 0.9; ++i) {
      world.set_pose({0.0, 0.25, 0.0}, {});
      usleep(1000);
    }
    std::_Exit(world.force_n().y > 0.9 ? 0 : 1);
  }
  ASSERT_FALSE(bench.device->engage());
  bench.start_running();
  EXPECT_TRUE(eventually([&] { return bench.body->sample().tip_position_mm.z == 0.25; }));
  bench.body->ask({0.0, 0.0, 1.0});
  int result = 0;
  ASSERT_EQ(waitpid(child, &result, 0), child);
  EXPECT_TRUE(WIFEXITED(result) && WEXITSTATUS(result) == 0);
  EXPECT_THROW(HdPage("/dev/null", HdPage::Join{}), std::runtime_error);
}

TEST(OpenHapticsLibrary, ADeviceIsOpenedByItsName) {
  HdBench bench([](OpenHapticsConfig& config) { config.device_name = "Second Device"; });
  ASSERT_FALSE(bench.device->engage());
  EXPECT_FALSE(bench.page.device(0).open);
  EXPECT_TRUE(bench.page.device(1).open);
  HdBench unknown([](OpenHapticsConfig& config) { config.device_name = "no such"; });
  const auto error = unknown.device->engage();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->value, "no such");
  EXPECT_NE(error->text().find("HD_COMM_CONFIG_ERROR"), std::string::npos) << error->text();
}

}  // namespace
}  // namespace hapticd::test
