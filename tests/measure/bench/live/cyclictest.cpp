#include "tests/measure/bench/live/cyclictest.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

namespace hapticd::bench {
namespace {

constexpr const char* kHistogramSpanUs = "20000";

/// The number after `label` on a line such as "# Max Latencies: 00123".
std::optional<double> labelled(const std::string& line, std::string_view label) {
  if (line.find(label) == std::string::npos) return std::nullopt;
  std::istringstream rest(line.substr(line.find(':') + 1));
  double value = 0.0;
  return rest >> value ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<LatencyDistribution> parse_cyclictest(std::string_view output) {
  std::istringstream lines{std::string(output)};
  LatencyDistribution wakeup;
  double overflows = 0.0;
  double max_us = 0.0;
  for (std::string line; std::getline(lines, line);) {
    if (const auto beyond = labelled(line, "Histogram Overflows:")) overflows += *beyond;
    if (const auto most = labelled(line, "Max Latencies:")) max_us = *most;
    std::istringstream cells(line);
    LatencyDistribution::Bin bin{};
    if (!line.empty() && line.front() != '#' && cells >> bin.from_us >> bin.count && bin.count > 0.0) {
      bin.up_to_us = bin.from_us + 1.0;  // cyclictest cuts the fraction off
      wakeup.bins.push_back(bin);
    }
  }
  if (overflows > 0.0) wakeup.bins.push_back({max_us, max_us, overflows});
  if (wakeup.bins.empty()) return std::nullopt;
  return wakeup;
}

Cyclictest::Cyclictest(double seconds, std::filesystem::path output, const CyclictestPlace& place)
    : output_(std::move(output)), duration_(std::llround(std::ceil(seconds))) {
  report::Launch launch{
      .command = {"cyclictest", "-m", "-p" + std::to_string(place.priority), "-i1000", "-t1", "-q", "-h",
                  kHistogramSpanUs, "-D", std::to_string(duration_.count())},
      .output = output_};
  if (place.cpu >= 0) launch.command.push_back("-a" + std::to_string(place.cpu));
  if (place.after_us >= 0) launch.command.push_back("--secaligned=" + std::to_string(place.after_us));
  try {
    process_ = std::make_unique<report::ChildProcess>(launch);
  } catch (const std::system_error& error) {
    failed_ = error.code() == std::errc::no_such_file_or_directory
                  ? "cyclictest is not installed; apt-get install rt-tests"
                  : error.what();
  }
}

Cyclictest::Outcome Cyclictest::finish() {
  if (!process_) return {std::nullopt, failed_};
  const auto status = process_->wait(duration_ + std::chrono::seconds(10));
  std::ostringstream text;
  text << std::ifstream(output_).rdbuf();
  const auto wakeup = parse_cyclictest(text.str());
  if (status == 0 && wakeup) return {wakeup, ""};
  return {std::nullopt, "cyclictest ended with status " + std::to_string(status.value_or(-1)) +
                            " (it needs the right to SCHED_FIFO): " + text.str().substr(0, 300)};
}

}  // namespace hapticd::bench
