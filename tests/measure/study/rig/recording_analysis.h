#pragma once

#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/replay/replay_rig.h"

namespace hapticd::study {

/// Force at which the stiffnesses are read off: reaction force while loading.
inline constexpr double kReadOffForceN = 1.0;

/// What the scene made of a recording the first time the force rose to kReadOffForceN.
struct LoadingPoint {
  double time_s = 0.0;
  double displacement_mm = 0.0;            ///< from the contact point
  double secant_stiffness_n_per_mm = 0.0;  ///< force over displacement
  double local_stiffness_n_per_mm =
      0.0;                        ///< slope of the least-squares line through 0.9 … 1.1 N of the loading
  double rendered_force_n = 0.0;  ///< what went to the device, along the press axis: positive pulls the tool
                                  ///< into the object (softer), negative holds against the hand (stiffer)
};

/// One recording through `tap_1d` at one target.
struct RecordingAnalysis {
  double peak_force_n = 0.0;             ///< largest reaction
  int contacts = 0;                      ///< in the whole recording
  int contacts_to_peak = 0;              ///< of these, declared before the largest reaction
  std::optional<double> contact_time_s;  ///< of the first contact
  double contact_force_n = 0.0;          ///< reaction in the tick that declared it
  std::optional<LoadingPoint> loading;   ///< none if kReadOffForceN is not reached
  std::string fault;                     ///< why the guard latched, if it did
};

/// Replays the recording through the composed scene `tap_1d`, a tick a millisecond. The reaction was recorded
/// as such, so the tool is taken as massless.
hal::Result<RecordingAnalysis> analyse_recording(const replay::ReplayConfig& recording,
                                                 double target_n_per_mm);

}  // namespace hapticd::study
