#pragma once

#include <cstdint>
#include <string>

#include "rt/model/models.h"

namespace hapticd::study {

/// What a search over accepted settings has found, by the simulation's truth.
struct SettingsOutcome {
  double scenes = 0.0;          ///< accepted and rendered for a contact and what follows it
  double targets = 0.0;         ///< set while they were, accepted too
  double models = 0.0;          ///< stored models of the rig that gave such a scene a value
  double refused = 0.0;         ///< drawn, and out of what is accepted
  double free_s = 0.0;          ///< in free air
  double free_air_max_n = 0.0;  ///< later than 20 ms after a contact
  double longest_ms = 0.0;      ///< a stretch of 0.05 N and more in free air, from a contact's end
  double step_max_n = 0.0;      ///< between two ticks; a cut by a fault aside
  double contact_max_n = 0.0;   ///< largest force in contact: that something was rendered at all
  double hardest = 0.0;         ///< number of the scene with the most force in free air
  double roughest = 0.0;        ///< and of that with the largest step

  double inputs() const { return scenes + targets + models; }
};

/// Draws scenes at random, with targets and stored models, over all that is accepted and its borders more
/// often than by chance, and renders each for one contact on a simulated rig in virtual time: a tap or a
/// press, and 80 ms of free air. `count` scenes, from the seed alone. `hardest_text` (may be null): the scene
/// with the most force in free air, as a file.
SettingsOutcome search_settings(std::uint64_t seed, int count, const rt::ObjectModel& model,
                                std::string* hardest_text = nullptr, std::string* roughest_text = nullptr);

}  // namespace hapticd::study
