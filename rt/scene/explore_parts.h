#pragma once

#include "hal/rig.h"
#include "rt/deformation/direction.h"
#include "rt/deformation/displacement.h"
#include "rt/model/models.h"
#include "rt/modulation/grip_inverse.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

// Stages of an explore scene, made from a resolved scene and the model it names.

Direction direction_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz);
Displacement displacement_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz);
/// Plant of a grip. The tip touches what is rendered: a linear target's stiffness, else nothing is known of
/// it.
GripPlant grip_plant_of(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo& rig);

}  // namespace hapticd::rt
