#include "tests/support/ticks/tick_sequence.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "hal/replay/csv_file.h"

namespace hapticd::test {

namespace {

/// The shortest interval that a made-up clock keeps, in shares of its period.
constexpr double kMinShare = 0.05;

/// Intervals that bring a clock from a tick that was `late_us` late back to its even times.
double back_in_time_us(double period_us, double late_us) {
  const double rest_us = std::fmod(late_us, period_us);
  const double left_us = period_us - rest_us;
  return left_us < kMinShare * period_us ? left_us + period_us : left_us;
}

}  // namespace

hal::Result<TickSequence> TickSequence::load(const std::string& path) {
  auto file = replay::CsvFile::open(path);
  if (!file) return file.error();
  const auto& names = file->columns();
  std::vector<std::size_t> columns;
  for (const char* name : {"interval_us", "sensor_records"}) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) return hal::Error{"a column is missing", file->place(), name, "", ""};
    columns.push_back(static_cast<std::size_t>(at - names.begin()));
  }
  TickIntervals ticks;
  std::vector<double> records;
  double total_us = 0.0;
  double total_records = 0.0;
  const auto error = file->read_rows(
      columns, [&](std::size_t line, std::span<const double> cells) -> std::optional<hal::Error> {
        if (!(cells[0] > 0.0 && cells[0] <= 1e7) || !(cells[1] >= 0.0 && cells[1] <= 1e6))
          return hal::Error{"a line holds no interval above 0 or no count", file->place(line), "", "", ""};
        ticks.push_back({cells[0]});
        records.push_back(cells[1]);
        total_us += cells[0];
        total_records += cells[1];
        return std::nullopt;
      });
  if (error) return *error;
  if (ticks.empty()) return hal::Error{"there are no ticks in it", file->place(), "", "", ""};
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
