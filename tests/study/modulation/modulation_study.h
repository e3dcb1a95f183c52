#pragma once

#include "tests/study/common/study.h"

namespace hapticd::study {

/// Friction at the hand against its target while stroking with a rod: kinetic, presliding, chatter.
void run_friction_target(StudyContext& context);

/// The stiffness that is rendered with a friction target and without.
void run_friction_stiffness(StudyContext& context);

}  // namespace hapticd::study
