#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Every fault of the table that a driver, a peer, the loop or a table can produce: injected while force is
/// rendered in contact, watched to zero, fixed, cleared, watched until force is whole again.
void run_faults(StudyContext& context);

}  // namespace hapticd::study
