#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Friction at the hand against its target while stroking with a rod: kinetic, presliding, chatter.
void run_friction_target(StudyContext& context);

/// The stiffness that is rendered with a friction target and without.
void run_friction_stiffness(StudyContext& context);

/// Frequency and decay of contact transients at the grip.
void run_transient_frequency(StudyContext& context);

/// Extended rate-hardness with transients and with stiffness shifting, onset, stiffness afterwards.
void run_transient_hardness(StudyContext& context);

}  // namespace hapticd::study
