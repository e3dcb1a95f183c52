#pragma once

#include <cstdint>

#include "server/identification/estimate/contact/press_frame.h"
#include "server/identification/session/identification.h"
#include "tests/emulated_rig/run.h"

namespace hapticd::test {

/// How what the rig measures is handed to an identification; see server/identification/run/rig_view.h.
enum class SeenAs : std::uint8_t {
  kRaw,      ///< tool, gains, structural stiffness
  kSeated,   ///< threshold
  kUpright,  ///< contact and friction: turned so that the press goes along -z
};

struct IdentifyRunConfig {
  SeenAs seen_as = SeenAs::kRaw;
  identification::PressGeometry geometry{};  ///< as the world is turned
  double tool_mass_g = 0.0;
  double limit_s = 90.0;  ///< of the run's time
};

struct IdentifyRunResult {
  double duration_s = 0.0;    ///< of the run's time
  double converged_s = -1.0;  ///< when it had converged; negative: it did not
  identification::IdentificationProgress progress;
  std::uint64_t external_readings = 0;             ///< of an instrument from outside
  rt::GuardFault latched = rt::GuardFault::kNone;  ///< why the guard was, where it was
};

/// Does what the identification requests on a rig of real drivers until it has converged, wants nothing more
/// or the time is over: the simulated hand moves, the device renders what is asked of it. Throws
/// std::runtime_error if a scene is refused.
IdentifyRunResult identify_on(Run& run, identification::Identification& identification,
                              const IdentifyRunConfig& config);

/// Rig for identification: its sensor drifts by 1 mN/s, its clock is late by 0.5 ms twice a second and by 5
/// ms every three seconds, and it has no scene in the way.
RunConfig rig_for_identification(const sim::SimulationConfig& simulation);

}  // namespace hapticd::test
