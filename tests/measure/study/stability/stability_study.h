#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Object stiffness × target stiffness for each device, gain set, loop rate, with and without passivity
/// control and structural compensation; the boundary next to the analytic bound and the dissertation's
/// ranges.
void run_stability_maps(StudyContext& context);

/// Object stiffness × device: how stiff an inclusion may be that is rendered in the object, both variants.
void run_inclusion_stability(StudyContext& context);

/// What each uncertain parameter does to the boundary.
void run_stability_sensitivity(StudyContext& context);

/// The wood plate: why it is unstable, and what would help.
void run_wood_plate(StudyContext& context);

}  // namespace hapticd::study
