#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/contribution/contribution.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

/// An effect that an explore scene may have in addition to its stiffness, and all that a scene needs of it.
struct Effect {
  bool (*is_asked_for)(const SceneSpec& spec);
  /// Line of `scene explain`. This and what follows are called for scenes that ask for the effect.
  std::string (*stage)(const SceneSpec& spec);
  std::uint32_t channels;  ///< groups of the record that it fills (bits of channel::)
  /// What is wrong with the scene's part, if anything; null: nothing can be. `model` may be null.
  std::optional<hal::Error> (*check)(const SceneSpec& spec, const ObjectModel* model,
                                     const hal::RigInfo& rig);
  std::unique_ptr<Contribution> (*make)(const SceneSpec& spec, const ObjectModel& model,
                                        const hal::RigInfo& rig);
  Contributions::List Contributions::*joins;  ///< the list that it belongs to
};

/// All effects, in the order in which their forces are added up.
std::span<const Effect> effects();

/// Exactly the contributions that a checked scene asks for.
Contributions contributions_of(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo& rig);

}  // namespace hapticd::rt
