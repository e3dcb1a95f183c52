#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// The stages of run_estimation_precision().

/// Direction and displacement, on the same strokes.
void run_stroke_precision(StudyContext& context);
/// Friction laws against the simulated friction.
void run_friction_precision(StudyContext& context);

}  // namespace hapticd::study
