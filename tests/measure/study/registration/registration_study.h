#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Target error of simulated arms that were never calibrated, on motion they were not calibrated with: rigid
/// only, without latency, and all together; predicted and observed.
void run_registration(StudyContext& context);

/// Error against run time and against how long one moves.
void run_registration_length(StudyContext& context);

}  // namespace hapticd::study
