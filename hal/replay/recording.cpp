#include "hal/replay/recording.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <span>

#include "hal/replay/table_file.h"
#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

// A month: beyond it the unit of the time is wrong, and ticks would no longer be counted exactly.
constexpr double kMaxS = 31.0 * 86400.0;

std::string in_seconds(double seconds) {
  return hal::number_text(seconds, 9) + " s";
}

double median_step(const std::vector<double>& time_s) {
  std::vector<double> steps(time_s.size());
  std::adjacent_difference(time_s.begin(), time_s.end(), steps.begin());
  steps.erase(steps.begin());  // the first is the first value itself
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// A force that grows older by as much as the time goes on is the same one; but for what is lost in writing.
constexpr double kSilentShare = 0.99;

/// Column in which hapticd records it: a tick that came late is a long step, too, but its force is not old.
ColumnRole role_of_force_age() {
  return {.name = "force age", .quantity = Quantity::kTime, .stems = {"sample_force_age"}};
}

}  // namespace

double Recording::silence_s(std::size_t row, double since_row_s) const noexcept {
  if (force_age_s.empty()) {
    const double step_s = time_s[row + 1] - time_s[row];
    return since_row_s < step_s && step_s > kGapSteps * median_step_s ? since_row_s : 0.0;
  }
  const std::size_t next = since_row_s > 0.0 ? row + 1 : row;
  if (next == 0) return 0.0;
  const double step_s = time_s[next] - time_s[next - 1];
  const double older_by_s = force_age_s[next] - force_age_s[next - 1];
  return older_by_s > kSilentShare * step_s ? force_age_s[row] + since_row_s : 0.0;
}

hal::Result<Recording> load_recording(const std::string& path, const RecordingColumns& columns,
                                      const CsvFormat& format) {
  auto opened = TableFile::open(path, format);
  if (!opened) return opened.error();
  const std::unique_ptr<TableFile>& file = *opened;

  const auto time = select_column(columns.time, Quantity::kTime, file->columns(), file->place());
  if (!time) return time.error();
  const auto force = select_column(columns.force, Quantity::kForce, file->columns(), file->place());
  if (!force) return force.error();
  const auto position = select_column(columns.position, Quantity::kPosition, file->columns(), file->place());
  if (!position) return position.error();

  Recording recording;
  double start_s = 0.0;
  std::vector<std::size_t> indices{time->index, force->index, position->index};
  double age_factor = 0.0;
  if (const ColumnRole role = role_of_force_age(); is_recognised(role, file->columns())) {
    const auto age = select_column({}, role, file->columns(), file->place());
    if (!age) return age.error();
    indices.push_back(age->index);
    age_factor = age->factor;
  }
  const auto take = [&](std::size_t line, std::span<const double> cells) -> std::optional<hal::Error> {
    const double now_s = cells[0] * time->factor;
    if (recording.time_s.empty()) start_s = now_s;
    const double since_start_s = now_s - start_s;
    if (!recording.time_s.empty() && !(since_start_s > recording.time_s.back())) {
      return time_does_not_increase(now_s, recording.time_s.back() + start_s, file->place(line));
    }
    if (since_start_s > kMaxS) {
      return hal::Error{.what = "the recording is too long",
                        .where = file->place(line),
                        .value = in_seconds(since_start_s),
                        .limit = "up to " + in_seconds(kMaxS),
                        .remedy = "check the unit of the time",
                        .code = hal::ErrorCode::kTooLong};
    }
    recording.time_s.push_back(since_start_s);
    recording.force_n.push_back(cells[1] * force->factor);
    recording.depth_mm.push_back(cells[2] * position->factor);
    if (age_factor > 0.0) recording.force_age_s.push_back(std::clamp(cells[3] * age_factor, 0.0, kMaxS));
    if (!std::isfinite(recording.force_n.back()) || !std::isfinite(recording.depth_mm.back())) {
      return hal::Error{.what = "the scaled force or position is not finite",
                        .where = file->place(line),
                        .value = {},
                        .limit = {},
                        .remedy = "check the units and scales of the mapping",
                        .code = hal::ErrorCode::kNotFinite};
    }
    return std::nullopt;
  };
  if (const auto error = file->read_rows(indices, take); error) return *error;
  if (recording.time_s.size() < 2) {
    return hal::Error{.what = "the recording has fewer than two rows",
                      .where = file->place(),
                      .value = std::to_string(recording.time_s.size()),
                      .limit = "at least 2 rows of numbers under the header",
                      .remedy = "record for longer",
                      .code = hal::ErrorCode::kMalformed};
  }
  recording.median_step_s = median_step(recording.time_s);
  return recording;
}

std::optional<hal::Error> remove_bias(Recording& recording, double seconds, const std::string& place) {
  if (!(seconds >= 0.0 && seconds <= recording.duration_s())) {
    return hal::Error{.what = "the time span for the zero force is outside the recording",
                      .where = place + ", bias_s",
                      .value = in_seconds(seconds),
                      .limit = "0 … " + in_seconds(recording.duration_s()),
                      .remedy = "0 leaves the force as recorded",
                      .code = hal::ErrorCode::kOutOfRange};
  }
  if (seconds == 0.0) return std::nullopt;
  const auto end = std::upper_bound(recording.time_s.begin(), recording.time_s.end(), seconds);
  const auto count = end - recording.time_s.begin();
  const double sum_n = std::accumulate(recording.force_n.begin(), recording.force_n.begin() + count, 0.0);
  const double mean_n = sum_n / static_cast<double>(count);
  for (double& force_n : recording.force_n) force_n -= mean_n;
  return std::nullopt;
}

}  // namespace hapticd::replay
