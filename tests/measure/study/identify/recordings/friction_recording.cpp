#include "tests/measure/study/identify/recordings/friction_recording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "hal/replay/csv_file.h"
#include "server/identification/session/friction_identification.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

using test::demand;
using test::value_of;

FrictionRecording read_friction_recording(const std::filesystem::path& path) {
  replay::CsvFile file = value_of(replay::CsvFile::open(path.string()));
  struct Column {
    std::size_t index;
    double RecordedFriction::*target;
  };
  std::vector<Column> columns;
  for (std::size_t i = 0; i < file.columns().size(); ++i) {
    const std::string& name = file.columns()[i];
    if (name == "time_s") columns.push_back({i, &RecordedFriction::time_s});
    if (name == "position_mm") columns.push_back({i, &RecordedFriction::position_mm});
    if (name == "force_N" || name == "friction_force_N") columns.push_back({i, &RecordedFriction::force_n});
    if (name == "normal_force_N") columns.push_back({i, &RecordedFriction::normal_n});
    if (name == "pressure_bar") columns.push_back({i, &RecordedFriction::pressure_bar});
  }
  if (columns.size() < 3) throw std::runtime_error(path.string() + " is no friction test");
  std::vector<std::size_t> indices;
  for (const Column& column : columns) indices.push_back(column.index);
  FrictionRecording recording;
  demand(
      file.read_rows(indices, [&](std::size_t, std::span<const double> cells) -> std::optional<hal::Error> {
        RecordedFriction row;
        for (std::size_t i = 0; i < columns.size(); ++i) row.*columns[i].target = cells[i];
        recording.push_back(row);
        return std::nullopt;
      }));
  return recording;
}

FrictionRecording part_of(const FrictionRecording& recording, double from_s, double to_s) {
  FrictionRecording part;
  std::copy_if(recording.begin(), recording.end(), std::back_inserter(part),
               [&](const RecordedFriction& r) { return r.time_s >= from_s && r.time_s < to_s; });
  return part;
}

hal::Result<rt::IdentifiedModel> identify_recording(const FrictionRecording& recording,
                                                    const identification::FrictionTask& task) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    steps.push_back(recording[i].time_s - recording[i - 1].time_s);
  }
  hal::RigInfo info;
  info.kind = hal::RigKind::kReplay;
  info.has_external_position = true;
  info.renders_force = false;
  if (!steps.empty()) {
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    info.rate_hz = 1.0 / *middle;
  }
  identification::FrictionIdentification identification(task, info);
  rt::Observation observation;
  observation.sample.force_count = 1;
  for (const RecordedFriction& r : recording) {
    observation.sample.time_ns = std::llround(1e9 * r.time_s);
    observation.sample.tip_position_mm.x = r.position_mm;
    observation.sample.sensor_force_n = {-r.force_n, 0.0, r.normal_n};
    identification.add(observation);
    ++observation.sample.tick;
  }
  return identification.finish();
}

std::vector<identification::FrictionRow> rows_of(const FrictionRecording& raw) {
  // Single outliers of the position are not motion.
  FrictionRecording recording = raw;
  for (std::size_t i = 1; i + 1 < raw.size(); ++i) {
    const double a = raw[i - 1].position_mm;
    const double b = raw[i].position_mm;
    const double c = raw[i + 1].position_mm;
    recording[i].position_mm = std::max(std::min(a, b), std::min(std::max(a, b), c));
  }
  identification::StrokePassages passages(0.0);
  std::vector<identification::FrictionRow> rows;
  std::uint64_t turns = 0;
  double turned_mm = recording.empty() ? 0.0 : recording.front().position_mm;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const RecordedFriction& r = recording[i];
    passages.add({r.time_s, r.position_mm, 0.0, -r.force_n, r.normal_n});
    if (passages.completed() != turns) turned_mm = r.position_mm;
    turns = passages.completed();
    identification::FrictionRow row;
    row.before =
        i == 0 ? identification::FrictionRow::State::kNothing : identification::FrictionRow::State::kGoesOn;
    if (i > 0) {
      row.slide_mm = r.position_mm - recording[i - 1].position_mm;
      row.speed_mm_per_s = row.slide_mm / (r.time_s - recording[i - 1].time_s);
    }
    row.path_mm = std::abs(r.position_mm - turned_mm);
    row.normal_n = r.normal_n;
    row.friction_n = r.force_n;
    row.along_mm = r.position_mm;
    row.passage = static_cast<int>(turns);
    row.settled = turns >= 2;
    rows.push_back(row);
  }
  return rows;
}

double force_delay_s(const FrictionRecording& recording) {
  constexpr std::size_t kRest = 40;  // samples at rest before a start, and looked at after it
  std::vector<double> delays;
  for (std::size_t i = kRest; i + kRest + 2 < recording.size(); ++i) {
    const auto moved_mm = [&](std::size_t from, std::size_t to) {
      return std::abs(recording[to].position_mm - recording[from].position_mm);
    };
    constexpr double kStillMm = 8e-4;
    if (moved_mm(i - kRest, i) > kStillMm || moved_mm(i, i + 5) < 4.0 * kStillMm) continue;
    if (moved_mm(i, i + 1) < kStillMm) continue;  // the very last moment of rest
    const auto slope = [&](std::size_t k) {
      return std::abs(recording[k + 1].force_n - recording[k - 1].force_n);
    };
    double steepest = 0.0;
    for (std::size_t k = i; k < i + kRest; ++k) steepest = std::max(steepest, slope(k));
    std::size_t k = i - kRest / 2;
    while (k < i + kRest && slope(k) < 0.5 * steepest) ++k;
    delays.push_back(recording[k].time_s - recording[i].time_s);
    i += kRest;
  }
  if (delays.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = delays.begin() + static_cast<std::ptrdiff_t>(delays.size() / 2);
  std::nth_element(delays.begin(), middle, delays.end());
  return *middle;
}

FrictionRecording with_force_advanced(const FrictionRecording& recording, double delay_s) {
  FrictionRecording advanced = recording;
  std::size_t k = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const double at_s = recording[i].time_s + delay_s;
    while (k + 2 < recording.size() && recording[k + 1].time_s < at_s) ++k;
    const RecordedFriction& a = recording[k];
    const RecordedFriction& b = recording[k + 1];
    const double share = std::clamp((at_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
    advanced[i].force_n = a.force_n + share * (b.force_n - a.force_n);
  }
  return advanced;
}

}  // namespace hapticd::study
