#pragma once

#include "tests/study/study.h"

namespace hapticd::study {

/// Real recordings replayed through `tap_1d`: contact instant, loading stiffness, force that would be
/// rendered.
void run_recordings(StudyContext& context);

/// Stiffness at the simulated hand against the target, held and while pressing, with and without structural compensation.
void run_rendered_stiffness(StudyContext& context);

/// False alarms in free motion and delay of detection.
void run_contact(StudyContext& context);

/// Largest stable target on objects and walls, and what uncertain parameters do to it.
void run_stability(StudyContext& context);

/// How much faster than real time the simulated rig runs.
void run_speed(StudyContext& context);

}  // namespace hapticd::study
