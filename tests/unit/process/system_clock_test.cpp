#include "server/process/system_clock.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

using Names = std::vector<std::string>;

void add_process(const std::filesystem::path& folder, const std::string& number, const std::string& command) {
  std::filesystem::create_directories(folder / number);
  std::ofstream(folder / number / "comm") << command << "\n";
}

TEST(SystemClock, ReadsTwoClocksCloseTogether) {
  const std::int64_t before = monotonic_ns();
  const ClockReading reading = read_clocks();
  EXPECT_GE(reading.monotonic_ns, before);
  EXPECT_LE(reading.monotonic_ns, monotonic_ns());
  EXPECT_GE(reading.apart_ns, 0);
  EXPECT_GT(reading.utc_ns, 0);
}

TEST(SystemClock, FindsWhoKeepsIt) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path();
  EXPECT_EQ(clock_keepers(path), Names{"unknown"});
  EXPECT_EQ(clock_keepers(path / "nothing"), Names{"unknown"});
  add_process(path, "12", "bash");
  add_process(path, "self", "chronyd");
  EXPECT_EQ(clock_keepers(path), Names{"unknown"}) << "no number, no process";
  add_process(path, "31", "systemd-timesyn");
  add_process(path, "14", "ptp4l");
  add_process(path, "15", "ptp4l");
  EXPECT_EQ(clock_keepers(path), (Names{"ptp4l", "systemd-timesyncd"}));
}

TEST(SystemClock, NamesThisStartOfTheMachine) {
  EXPECT_EQ(boot_name(), boot_name());
  EXPECT_EQ(boot_name("/nowhere"), "unknown");
}

TEST(SystemClock, SaysNothingAboutAnErrorOfAFreeClock) {
  const KernelClock clock = kernel_clock();
  EXPECT_EQ(clock.max_error_ms.has_value(), clock.utc == UtcKeeping::kSynchronized);
}

}  // namespace
}  // namespace hapticd::server
