#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Force over displacement at 0, 10 and 20 mm from the tumour, hard and soft, rendered against real, as D
/// Fig. 5.4; both variants, presses of 20 to 100 mm/s.
void run_tumour_force(StudyContext& context);

/// The place of ten inclusions from a scan of each, against the true one.
void run_inclusion_place(StudyContext& context);

/// Jumps and bounds of the rendered force while rubbing, crossing the line l_0 and passing the tumour.
void run_tumour_bounds(StudyContext& context);

}  // namespace hapticd::study
