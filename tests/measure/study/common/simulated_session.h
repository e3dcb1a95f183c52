#pragma once

#include <functional>

#include "hal/samples.h"
#include "hal/sim/simulated_rig.h"
#include "server/identification/session/identification.h"

namespace hapticd::study {

/// What an identification on the simulated rig took.
struct SessionResult {
  double duration_s = 0.0;     ///< of the rig's time
  double converged_s = -1.0;   ///< when it had converged; negative: it did not
  double computation_s = 0.0;  ///< processor time spent in the identification itself
  identification::IdentificationProgress progress;
};

/// Does what the identification requests on a simulated rig in virtual time until it has converged, wants
/// nothing more, or `limit_s` is over. No force is rendered but what a request asks for. `watch`, if given,
/// sees every observation with the truth behind it, e.g. to keep a recording for other methods. Throws
/// std::runtime_error if the rig cannot be made.
SessionResult run_session(
    identification::Identification& identification, const sim::SimulationConfig& rig, double limit_s,
    const std::function<void(const rt::Observation&, const hal::TruthSample&)>& watch = {});

}  // namespace hapticd::study
