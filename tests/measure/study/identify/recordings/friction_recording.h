#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "rt/model/identified_model.h"
#include "server/identification/estimate/friction/friction_rows.h"
#include "server/identification/session/tasks.h"

namespace hapticd::study {

/// One row of a recorded friction test.
struct RecordedFriction {
  double time_s = 0.0;
  double position_mm = 0.0;
  double force_n = 0.0;       ///< that moves the tip against friction
  double normal_n = 0.0;      ///< 0 if it was not recorded
  double pressure_bar = 0.0;  ///< 0 if there is none
};
using FrictionRecording = std::vector<RecordedFriction>;

/// Reads a CSV file of a friction test; throws std::runtime_error with what is wrong.
FrictionRecording read_friction_recording(const std::filesystem::path& file);

/// Part between two times.
FrictionRecording part_of(const FrictionRecording& recording, double from_s, double to_s);

/// What FrictionIdentification makes of it.
hal::Result<rt::IdentifiedModel> identify_recording(const FrictionRecording& recording,
                                                    const identification::FrictionTask& task);

/// Rows of a recording, one for every instant, the position through a median of three. `settled` from the
/// second turn on: the state at the beginning of the part is unknown.
std::vector<identification::FrictionRow> rows_of(const FrictionRecording& recording);

/// How much later than the position the force is, model-free: after each rest the tip starts at once, and the
/// force should bend at that moment. Symmetric smoothing, as recorders do it, leaves the bend where half the
/// new slope is reached. Median over the starts; NaN without any.
double force_delay_s(const FrictionRecording& recording);
/// The recording with the force read so much later, by linear interpolation.
FrictionRecording with_force_advanced(const FrictionRecording& recording, double delay_s);

}  // namespace hapticd::study
