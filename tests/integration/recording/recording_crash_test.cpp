// A daemon that is killed while it records loses at most the last second, and leaves an incident.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

#include "client/cpp/client.h"
#include "hal/recording/recording_names.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/recording/seen_recording.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kCrashTimeout{60};
constexpr std::int64_t kTicksPerS = 1000;

/// One folder, and daemons that follow one another in it.
class RecordingCrash : public testing::Test {
 protected:
  RecordingCrash() {
    const std::string state = folder_.path("state");
    config_ = folder_.write("hapticd.toml",
                            "[loop]\nfifo_priority = 0\nlock_memory = false\nkeep_cpu_awake = false\n"
                            "[network]\nlisten = \"127.0.0.1:0\"\n[recording]\nfolder = \"" +
                                state + "\"\nkeep_free_mb = 0.0\n");
  }
  std::unique_ptr<DaemonProcess> started() {
    auto daemon =
        std::make_unique<DaemonProcess>(std::vector<std::string>{"--config", config_, "--log-level", "off"});
    address_ = daemon->await_address();
    return daemon;
  }
  client::Client client() const { return client::Client({.address = address_, .timeout = kCrashTimeout}); }

  /// Has a daemon record for `run_time`, ends it by a signal; then the last tick that was surely rendered
  /// before.
  std::int64_t killed_while_recording(std::chrono::milliseconds run_time, int signal) {
    const auto daemon = started();
    std::int64_t last = 0;
    {
      client::Client client = this->client();
      client.start_recording({});
      std::this_thread::sleep_for(run_time);
      last = static_cast<std::int64_t>(client.rig_state(client::Histograms::kWithout).tick());
      daemon->signal(signal);
    }
    EXPECT_EQ(daemon->wait(), -signal);
    return last;
  }
  /// Files whose names have these words: a machine that has much to do leaves incidents of overruns as well.
  std::vector<fs::path> files(const std::string& kind, const std::string& words = "") const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_.path("state") + "/" + kind)) {
      if (entry.path().filename().string().find(words) != std::string::npos) found.push_back(entry);
    }
    std::sort(found.begin(), found.end());
    return found;
  }
  /// Starts a daemon, has it finish what was left, and ends it in order.
  void recover(std::size_t incidents) {
    const auto daemon = started();
    EXPECT_TRUE(eventually([&] { return files("incidents", "_unclean_end").size() >= incidents; }));
    daemon->end();
  }

  const TemporaryFolder folder_;
  std::string config_;
  std::string address_;
};

TEST_F(RecordingCrash, KilledAtAnyMomentItLosesAtMostTheLastSecond) {
  std::mt19937 random(20261124);
  std::uniform_int_distribution<int> run_ms(700, 2200);
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    const int signal = round == kRounds - 1 ? SIGSEGV : SIGKILL;
    const std::int64_t last = killed_while_recording(std::chrono::milliseconds(run_ms(random)), signal);
    recover(static_cast<std::size_t>(round) + 1);
    const auto recordings = files("recordings");
    ASSERT_EQ(recordings.size(), static_cast<std::size_t>(round) + 1);
    const SeenRecording recorded = seen_of(recordings.back());
    EXPECT_TRUE(recorded.is_finished);
    const recording::Texts& end = recorded.metadata.at(recording::kEndMetadata);
    EXPECT_TRUE(end.contains("repaired"));
    EXPECT_GE(recorded.ticks.back(), last - kTicksPerS);
    EXPECT_EQ(recorded.missing_ticks(), 0);
    EXPECT_EQ(end.at("rows"), std::to_string(recorded.ticks.size()))
        << "it would be listed with another number of rows";

    const auto incidents = files("incidents", "_unclean_end");
    ASSERT_EQ(incidents.size(), static_cast<std::size_t>(round) + 1);
    const SeenRecording flown = seen_of(incidents.back());
    EXPECT_EQ(flown.metadata.at(recording::kStartMetadata).at("cause"), "unclean_end");
    EXPECT_GE(flown.ticks.back(), last - kTicksPerS / 2) << "the flight recorder is closer";
    EXPECT_EQ(flown.missing_ticks(), 0);
  }
}

}  // namespace
}  // namespace hapticd::test
