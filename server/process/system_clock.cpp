#include "server/process/system_clock.h"

#include <sys/timex.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <system_error>

namespace hapticd::server {

namespace {

constexpr const char* kUnknown = "unknown";

std::int64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{1'000'000'000} * time.tv_sec + time.tv_nsec;
}

std::string first_line(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

}  // namespace

std::int64_t monotonic_ns() {
  return clock_ns(CLOCK_MONOTONIC);
}

ClockReading read_clocks() {
  constexpr int kTries = 5;
  ClockReading best;
  best.apart_ns = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < kTries; ++i) {
    const std::int64_t before = monotonic_ns();
    const std::int64_t utc = clock_ns(CLOCK_REALTIME);
    const std::int64_t after = monotonic_ns();
    const std::int64_t apart = (after - before + 1) / 2;
    if (apart < best.apart_ns) best = {before + (after - before) / 2, utc, apart};
  }
  return best;
}

KernelClock kernel_clock() {
  KernelClock clock;
  timex now{};
  const int state = adjtimex(&now);
  if (state < 0) return clock;
  clock.frequency_ppm = static_cast<double>(now.freq) / 65536.0;
  const bool synchronized = state != TIME_ERROR && (now.status & STA_UNSYNC) == 0;
  clock.utc = synchronized ? UtcKeeping::kSynchronized : UtcKeeping::kUnsynchronized;
  if (synchronized) clock.max_error_ms = 1e-3 * static_cast<double>(now.maxerror);
  return clock;
}

std::vector<std::string> clock_keepers(const std::string& processes) {
  // As the kernel shortens them.
  constexpr std::array<std::array<const char*, 2>, 5> kKeepers{{{"chronyd", "chronyd"},
                                                                {"ptp4l", "ptp4l"},
                                                                {"phc2sys", "phc2sys"},
                                                                {"ntpd", "ntpd"},
                                                                {"systemd-timesyn", "systemd-timesyncd"}}};
  std::vector<std::string> names;
  std::error_code failure;
  for (auto entry = std::filesystem::directory_iterator(processes, failure);
       !failure && entry != std::filesystem::directory_iterator(); entry.increment(failure)) {
    const std::string number = entry->path().filename();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string command = first_line(entry->path() / "comm");
    for (const auto& [shortened, name] : kKeepers) {
      if (command == shortened && std::find(names.begin(), names.end(), name) == names.end())
        names.emplace_back(name);
    }
  }
  if (names.empty()) names.emplace_back(kUnknown);
  std::sort(names.begin(), names.end());
  return names;
}

std::string boot_name(const std::string& path) {
  std::string name = first_line(path);
  return name.empty() ? kUnknown : name;
}

}  // namespace hapticd::server
