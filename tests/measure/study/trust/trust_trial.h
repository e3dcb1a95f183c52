#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/samples.h"
#include "rt/model/models.h"
#include "rt/record/tick_record.h"
#include "rt/scene/scene_spec.h"
#include "tests/measure/study/trust/trust_cause.h"

namespace hapticd::study {

/// The models that the explore scenes are loaded with; null if a scene needs none.
struct TrustModels {
  const rt::ObjectModel* ours = nullptr;
  const rt::ObjectModel* published = nullptr;  ///< what the dissertation's procedure gives
};

/// One run: a scene on a rig under one cause.
struct TrustCase {
  const TrustCause* cause = nullptr;
  std::string scene = "tap_1d";  ///< tap_1d, explore_rod, explore_bearing, wall
  std::string device = "phantom_1_0";
  double rate_hz = 1000.0;
  std::uint64_t seed = 1;
  bool published = false;    ///< the dissertation's pipeline in place of ours
  double duration_s = 16.0;  ///< a cause may ask for more

  std::string text() const;  ///< one line that names the case, enough to run it again
};

std::vector<std::string> trust_scenes();
std::vector<std::string> trust_devices();

/// What was seen where, by the truth, nothing was touched.
struct TrustOutcome {
  double simulated_s = 0.0;
  double free_s = 0.0;
  double max_n = 0.0;  ///< largest force later than 20 ms after a contact
  double max_at_s = 0.0;
  double longest_ms = 0.0;  ///< longest stretch at 0.05 N or more; after a contact, from its end
  double longest_at_s = 0.0;
  double declared = 0.0;      ///< contacts declared that were none
  double withdrawn = 0.0;     ///< contacts the scene took back
  double zero_n = 0.0;        ///< how far the scene has followed the sensor's zero in the end
  double silent_share = 0.0;  ///< of the time in free air the guard gave no force, whatever was asked
  bool holds = true;
};

/// A tick of a run, for a plot.
struct TrustTick {
  double time_s = 0.0;
  double force_n = 0.0;
  bool touching = false;
  bool in_contact = false;  ///< as the scene believes
};

/// Runs a case. `trace` (may be null) gets the ticks from `trace_from_s` to `trace_to_s`.
TrustOutcome run_trust_case(const TrustCase& trial, const TrustModels& models,
                            std::vector<TrustTick>* trace = nullptr, double trace_from_s = 0.0,
                            double trace_to_s = 0.0);

/// The scene of a case, and the rig it runs on.
rt::SceneSpec trust_scene(const TrustCase& trial);
sim::SimulationConfig trust_rig(const TrustCase& trial);

/// How far the sensor's zero was followed, where the record says so.
template <class Record>
double followed_zero_n(const Record& record) {
  if constexpr (requires { record.zero.force_n; }) {
    const hal::Vector3 zero = record.zero.force_n;
    return std::sqrt(dot(zero, zero));
  } else {
    return 0.0;
  }
}
template <class Record>
std::uint32_t withdrawn_contacts(const Record& record) {
  if constexpr (requires { record.withdrawn_count; }) {
    return record.withdrawn_count;
  } else {
    return 0;
  }
}

}  // namespace hapticd::study
