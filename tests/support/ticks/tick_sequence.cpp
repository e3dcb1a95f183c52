#include "tests/support/ticks/tick_sequence.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

namespace hapticd::test {

namespace {

/// The shortest interval that a made-up clock keeps, in shares of its period.
constexpr double kMinShare = 0.05;

/// Hours of ticks.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{64} << 20U;

/// Index of a column in a header line; -1 without it.
int column_of(const std::string& header, std::string_view name) {
  std::istringstream fields(header);
  std::string field;
  for (int i = 0; std::getline(fields, field, ','); ++i) {
    while (!field.empty() && (field.back() == '\r' || field.back() == ' ')) field.pop_back();
    if (field == name) return i;
  }
  return -1;
}

bool number_in(const std::string& line, int column, double& value) {
  std::istringstream fields(line);
  std::string field;
  for (int i = 0; i <= column; ++i) {
    if (!std::getline(fields, field, ',')) return false;
  }
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc{} && end != field.data() && std::isfinite(value);
}

/// Intervals that bring a clock from a tick that was `late_us` late back to its even times.
double back_in_time_us(double period_us, double late_us) {
  const double rest_us = std::fmod(late_us, period_us);
  const double left_us = period_us - rest_us;
  return left_us < kMinShare * period_us ? left_us + period_us : left_us;
}

}  // namespace

hal::Result<TickSequence> TickSequence::load(const std::string& path) {
  const auto refuse = [&path](const char* what, const std::string& value) {
    return hal::Error{what, "sequence of ticks '" + path + "'", value,
                      "CSV with the columns interval_us and sensor_records", ""};
  };
  std::error_code code;
  const std::uintmax_t bytes = std::filesystem::file_size(path, code);
  if (code) return refuse("cannot be read", code.message());
  if (bytes > kMaxBytes) return refuse("the file is larger than 64 MiB", std::to_string(bytes) + " bytes");
  std::ifstream file(path);
  std::string line;
  if (!file || !std::getline(file, line)) return refuse("cannot be read", "");
  const int interval_column = column_of(line, "interval_us");
  const int records_column = column_of(line, "sensor_records");
  if (interval_column < 0 || records_column < 0) return refuse("a column is missing", line);
  TickIntervals ticks;
  std::vector<double> records;
  double total_us = 0.0;
  double total_records = 0.0;
  while (std::getline(file, line)) {
    if (line.empty()) continue;
    TickInterval tick;
    double count = 0.0;
    if (!number_in(line, interval_column, tick.interval_us) || !number_in(line, records_column, count) ||
        !(tick.interval_us > 0.0 && tick.interval_us <= 1e7) || !(count >= 0.0 && count <= 1e6)) {
      return refuse("a line holds no interval above 0 or no count", line);
    }
    ticks.push_back(tick);
    records.push_back(count);
    total_us += tick.interval_us;
    total_records += count;
  }
  if (ticks.empty()) return refuse("there are no ticks in it", "");
  if (total_records > 0.0) {
    // Passed since the beginning, less what the records that have arrived stand for.
    const double record_us = total_us / total_records;
    double passed_us = 0.0;
    double arrived_us = 0.0;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      passed_us += ticks[i].interval_us;
      arrived_us += record_us * records[i];
      // Within one record it cannot be felt.
      const double behind_us = passed_us - arrived_us;
      ticks[i].sensor_late_us = behind_us > record_us ? behind_us : 0.0;
    }
  }
  return TickSequence(std::move(ticks));
}

TickSequence TickSequence::late(double period_us, double late_us, int every) {
  return bursts(period_us, late_us, 1, every);
}

TickSequence TickSequence::bursts(double period_us, double late_us, int length, int every) {
  TickIntervals ticks(static_cast<std::size_t>(std::max(1, every)), TickInterval{period_us});
  for (int i = 0; i < length; ++i) ticks.push_back({period_us + late_us});
  ticks.push_back({back_in_time_us(period_us, length * late_us)});
  return TickSequence(std::move(ticks));
}

TickSequence TickSequence::bunched(double period_us, double late_us, int every) {
  TickIntervals ticks(static_cast<std::size_t>(std::max(1, every)), TickInterval{period_us});
  // The stream is at rest until it is `late_us` behind.
  for (double behind_us = period_us; behind_us < late_us; behind_us += period_us) {
    ticks.push_back({period_us, behind_us});
  }
  ticks.push_back({period_us, late_us});
  return TickSequence(std::move(ticks));
}

TickSequence TickSequence::lost(double period_us, int length, int every) {
  TickIntervals ticks(static_cast<std::size_t>(std::max(1, every)), TickInterval{period_us});
  for (int i = 0; i < length; ++i) ticks.push_back({period_us, 0.0, true});
  return TickSequence(std::move(ticks));
}

TickSequence TickSequence::at_rate(double recorded_hz, double rate_hz) const {
  if (recorded_hz == rate_hz) return *this;
  const double recorded_us = 1e6 / recorded_hz;
  const double period_us = 1e6 / rate_hz;
  const auto each = static_cast<int>(std::max(1L, std::lround(rate_hz / recorded_hz)));
  TickIntervals ticks;
  double owed_us = 0.0;  // by which the clock is behind its even times
  for (const TickInterval& tick : ticks_) {
    owed_us += tick.interval_us - recorded_us;
    for (int i = 0; i < each; ++i) {
      const double interval_us = std::max(kMinShare * period_us, period_us + owed_us);
      owed_us -= interval_us - period_us;
      ticks.push_back({interval_us, tick.sensor_late_us, tick.sensor_lost});
    }
  }
  return TickSequence(std::move(ticks));
}

}  // namespace hapticd::test
