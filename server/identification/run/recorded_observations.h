#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/column_mapping.h"
#include "hal/replay/csv_file.h"
#include "hal/rig.h"
#include "rt/record/observation.h"
#include "server/identification/run/bend_columns.h"

namespace hapticd::server {

/// Columns of a recording that are asked for, and as what they are handed on.
enum class RecordedMotion : std::uint8_t {
  kPress,   ///< "time", "force" and "position" into the object: along -z
  kStroke,  ///< "time", "position" along the stroke (x), "force" that moves the tip against friction, and
            ///< "normal_force" if there is one
  kFree,  ///< "time", "force_x" … "torque_z" in the sensor's frame, and "position_x" …, "orientation_w" …
          ///< if there are any
  kScan,   ///< the same with a position: presses all over an object
  kBend,   ///< "time", the encoders' position, the device's force on the tip and the tip's position by an
           ///< instrument from outside; see bend_columns.h
  kRigid,  ///< the same without the instrument, pressed on a rigid object
};

/// Recording as its owner describes it.
struct RecordingDescription {
  std::string name;                                      ///< for errors and reports
  std::map<std::string, replay::ColumnMapping> columns;  ///< by quantity; the rest is found by name
  bool decimal_comma = false;                            ///< of CSV
};

/// Summary from a first pass over a recording.
struct RecordingSummary {
  std::size_t rows = 0;
  double duration_s = 0.0;
  double median_step_s = 0.0;
  double longest_step_s = 0.0;
};

/// Recording as the observations that a rig would have made, row by row: memory does not grow with the file.
class RecordedObservations {
 public:
  /// Reads the file once. Refuses, with line and column, what TableFile and select_column() refuse,
  /// quantities that do not belong to the motion, time that does not increase, fewer than ten rows and more
  /// than a month. `press_direction` (rig frame, of any length): kBend and kRigid, of what was measured along
  /// one axis only. Ends with an error soon after `given_up` is set.
  static hal::Result<RecordedObservations> open(const std::string& path, RecordedMotion motion,
                                                const RecordingDescription& description,
                                                const hal::Vector3& press_direction = {0.0, 0.0, -1.0},
                                                const std::atomic<bool>* given_up = nullptr);

  const RecordingSummary& summary() const noexcept { return summary_; }
  /// Quantities that were found by hapticd's own names of columns, in words; see recording_columns.h.
  const std::vector<std::string>& own_columns() const noexcept { return own_columns_; }
  /// Properties of a rig of kind kReplay with a rate of one over the median step; nothing is known of its
  /// device and sensor. The position of strokes is an instrument's, unless hapticd recorded it from encoders.
  hal::RigInfo rig_info() const;

  /// Passes every row to the visitor, which ends it by returning false.
  std::optional<hal::Error> read(const std::function<bool(const rt::Observation&)>& visit) const;

 private:
  struct Column {
    replay::ColumnSelection selection;
    std::size_t target = 0;  ///< which of the row's numbers
  };

  std::string path_;
  replay::CsvFormat format_;
  RecordedMotion motion_ = RecordedMotion::kPress;
  BendAxes bend_;  ///< kBend and kRigid
  std::string name_;
  bool written_here_ = false;  ///< by hapticd, so its positions are encoders'
  std::vector<Column> columns_;
  std::vector<std::string> own_columns_;
  RecordingSummary summary_;
};

}  // namespace hapticd::server
