#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/recording/parts.h"
#include "tests/support/http_get.h"

namespace hapticd::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kShownOn = "metrics are shown on http://127.0.0.1:";

std::uint16_t metrics_port(const fs::path& log) {
  std::ostringstream text;
  text << std::ifstream(log).rdbuf();
  const std::size_t at = text.str().find(kShownOn);
  if (at == std::string::npos) throw std::runtime_error("the daemon does not say where its metrics are");
  return static_cast<std::uint16_t>(std::stoi(text.str().substr(at + kShownOn.size())));
}

/// Memory by one line of /proc/PID/smaps_rollup, in MB.
double memory_mb(pid_t pid, const std::string& key) {
  std::ifstream rollup("/proc/" + std::to_string(pid) + "/smaps_rollup");
  for (std::string line; std::getline(rollup, line);) {
    if (line.starts_with(key)) return 1024e-6 * std::stod(line.substr(key.size()));
  }
  throw std::runtime_error("there is no line '" + key + "' in smaps_rollup");
}

double median_scrape_ms(std::uint16_t port, int scrapes) {
  std::vector<double> times_ms;
  for (int i = 0; i < scrapes; ++i) {
    const auto began = std::chrono::steady_clock::now();
    if (test::http_get(port, "/metrics").find("hapticd_loop_lateness_seconds") == std::string::npos)
      throw std::runtime_error("a scrape has no lateness of the loop");
    times_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
  }
  std::nth_element(times_ms.begin(), times_ms.begin() + scrapes / 2, times_ms.end());
  return times_ms[static_cast<std::size_t>(scrapes / 2)];
}

}  // namespace

void add_service_figures(const fs::path& folder, bool quick, const AddFigure& add) {
  report::Figure scrape{.figure = "scrape_ms", .unit = "ms", .source = "median, on loopback"};
  report::Figure locked{.figure = "locked_memory_mb",
                        .unit = "MB",
                        .goal = 100.0,
                        .source = "resident and locked, with a scene, recording, flight recorder, metrics"};
  report::Figure grown{.figure = "locked_memory_growth_mb",
                       .conditions = {{"seconds", quick ? 10.0 : 120.0}},
                       .unit = "MB",
                       .source = "resident and locked"};
  const fs::path log = folder / "service.log";
  try {
    DaemonProcess daemon(
        log, {.more_configuration = "lock_memory = true\n[recording]\nfolder = \"" +
                                    (folder / "service").string() +
                                    "\"\nkeep_free_mb = 0.0\n[metrics]\nlisten = \"127.0.0.1:0\"\n"});
    scrape.value = median_scrape_ms(metrics_port(log), quick ? 50 : 500);
    // The kernel counts pages as locked with some delay; the flight recorder's ring fills in 30 s.
    std::this_thread::sleep_for(std::chrono::seconds(quick ? 2 : 60));
    locked.value = memory_mb(daemon.pid(), "Locked:");
    if (*locked.value == 0.0) {
      locked.value.reset();
      throw std::runtime_error("no memory is locked: not allowed here (ulimit -l)");
    }
    std::this_thread::sleep_for(std::chrono::seconds(quick ? 10 : 120));
    grown.value = memory_mb(daemon.pid(), "Locked:") - *locked.value;
    daemon.stop();
  } catch (const std::exception& error) {
    for (report::Figure* figure : {&scrape, &locked, &grown}) {
      if (!figure->value) figure->failed = error.what();
    }
  }
  add("scrape_ms", scrape);
  add("locked_memory_mb", locked);
  add("locked_memory_growth_mb", grown);
}

}  // namespace hapticd::bench
