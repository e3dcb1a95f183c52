#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/column_mapping.h"
#include "hal/replay/csv_file.h"

namespace hapticd::replay {

/// Columns of the three quantities of a one-dimensional recording.
struct RecordingColumns {
  ColumnMapping time{};
  ColumnMapping force{};
  ColumnMapping position{};
};

/// A recording in s, N and mm: all rows of a file, checked. Time begins at 0 and increases.
struct Recording {
  std::vector<double> time_s;
  std::vector<double> force_n;
  std::vector<double> depth_mm;
  /// Age of the newest force sample at each row; empty if the file does not say.
  std::vector<double> force_age_s;
  double median_step_s = 0.0;

  double duration_s() const noexcept { return time_s.back(); }
  /// How long the sensor had sent nothing at a time after `row`, before the next one; 0 if it sends. As the
  /// file says. If it does not, a step of more than kGapSteps times the median one is silence.
  double silence_s(std::size_t row, double since_row_s) const noexcept;

  static constexpr double kGapSteps = 5.0;
};

/// Reads the whole file. Errors: those of TableFile and select_column(), time that does not increase (with
/// the line), fewer than two rows.
hal::Result<Recording> load_recording(const std::string& path, const RecordingColumns& columns,
                                      const CsvFormat& format = {});

/// Takes the mean force of the first `seconds` as zero force. Refuses a span that is negative, not finite or
/// longer than the recording; 0 changes nothing.
std::optional<hal::Error> remove_bias(Recording& recording, double seconds, const std::string& place);

}  // namespace hapticd::replay
