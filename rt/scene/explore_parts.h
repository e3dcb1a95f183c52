#pragma once

#include "hal/rig.h"
#include "rt/explore/explored_contact.h"
#include "rt/explore/stiffness_force.h"
#include "rt/explore/tool_motion.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

// Stages of an explore scene, made from a resolved scene and the model it names.

ToolMotion tool_motion_of(const SceneSpec& spec, const hal::RigInfo& rig);
ExploredContact explored_contact_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz);
StiffnessForce stiffness_force_of(const SceneSpec& spec, double rate_hz);

}  // namespace hapticd::rt
