#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// What only the machine can feel, measured by `hapticd_bench` next to this program and taken into the
/// report.

/// What each scene composes and costs, next to the same scene with everything forced on.
void run_scene_economy(StudyContext& context);

/// The live loop under load, from command to effect, telemetry fan-out.
void run_realtime_cost(StudyContext& context);

}  // namespace hapticd::study
