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
  double normal_n = 0.0;      ///< 0 where it was not recorded
  double pressure_bar = 0.0;  ///< 0 where there is none
};
using FrictionRecording = std::vector<RecordedFriction>;

/// Reads a CSV file of a friction test; throws std::runtime_error with what is wrong.
FrictionRecording read_friction_recording(const std::filesystem::path& file);

/// Those between two times.
FrictionRecording part_of(const FrictionRecording& recording, double from_s, double to_s);

/// What FrictionIdentification makes of it.
hal::Result<rt::IdentifiedModel> identify_recording(const FrictionRecording& recording,
                                                    const identification::FrictionTask& task);

/// Every instant as a row of its own, the position through a median of three. `settled` from the second turn
/// on: where the state was when the part began no one knows.
std::vector<identification::FrictionRow> rows_of(const FrictionRecording& recording);

/// How much later than the position the force is, model-free: after each rest the tip starts at once, and the
/// force should bend at that moment. Symmetric smoothing, as recorders do it, leaves the bend where half the
/// new slope is reached. Median over the starts; NaN without any.
double force_delay_s(const FrictionRecording& recording);
/// The recording with the force read so much later, by linear interpolation.
FrictionRecording with_force_advanced(const FrictionRecording& recording, double delay_s);

}  // namespace hapticd::study
