#pragma once

#include "tests/study/study.h"

namespace hapticd::study {

/// What each scene composes and costs, beside the same scene with everything forced on.
void run_scene_economy(StudyContext& context);

}  // namespace hapticd::study
