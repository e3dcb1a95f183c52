#include "tests/bench/live/cyclictest.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

namespace hapticd::bench {
namespace {

constexpr const char* kHistogramSpanUs = "20000";

struct Bin {
  double latency_us;
  double count;
};

/// The number after `label` on a line such as "# Max Latencies: 00123".
std::optional<double> labelled(const std::string& line, std::string_view label) {
  if (line.find(label) == std::string::npos) return std::nullopt;
  std::istringstream rest(line.substr(line.find(':') + 1));
  double value = 0.0;
  return rest >> value ? std::optional(value) : std::nullopt;
}

double quantile(const std::vector<Bin>& bins, double total, double share, double beyond_us) {
  double seen = 0.0;
  for (const Bin& bin : bins) {
    seen += bin.count;
    if (seen >= share * total) return bin.latency_us;
  }
  return beyond_us;
}

}  // namespace

std::optional<WakeupQuantiles> parse_cyclictest(std::string_view output) {
  std::istringstream lines{std::string(output)};
  std::vector<Bin> bins;
  double total = 0.0;
  WakeupQuantiles wakeup;
  for (std::string line; std::getline(lines, line);) {
    if (const auto overflows = labelled(line, "Histogram Overflows:")) total += *overflows;
    if (const auto most = labelled(line, "Max Latencies:")) wakeup.max_us = *most;
    std::istringstream cells(line);
    Bin bin{};
    if (!line.empty() && line.front() != '#' && cells >> bin.latency_us >> bin.count) {
      bins.push_back(bin);
      total += bin.count;
    }
  }
  if (total <= 0.0) return std::nullopt;
  wakeup.median_us = quantile(bins, total, 0.5, wakeup.max_us);
  wakeup.p99_us = quantile(bins, total, 0.99, wakeup.max_us);
  wakeup.p999_us = quantile(bins, total, 0.999, wakeup.max_us);
  return wakeup;
}

Cyclictest::Cyclictest(double seconds, std::filesystem::path output)
    : output_(std::move(output)), duration_(std::llround(std::ceil(seconds))) {
  try {
    process_ = std::make_unique<report::ChildProcess>(
        report::Launch{.command = {"cyclictest", "-m", "-p80", "-i1000", "-t1", "-q", "-h", kHistogramSpanUs,
                                   "-D", std::to_string(duration_.count())},
                       .output = output_});
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
