#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Every stage at its extremes: simulator, friction, inverse laws, filters, recursive estimators, time
/// stamps.
void run_extremes(StudyContext& context);

/// The dissertation's equations that fail as published, next to the forms used here.
void run_traps(StudyContext& context);

}  // namespace hapticd::study
