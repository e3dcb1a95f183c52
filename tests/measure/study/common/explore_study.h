#pragma once

#include <string>

#include "tests/measure/study/common/palpation.h"
#include "tests/measure/study/common/parts.h"

namespace hapticd::study {

/// The model of a simulated object of the current plant, identified on it once a run by the service's own
/// sessions; with a Hunt-Crossley law in any case.
const IdentificationResult& identified(const std::string& object);

}  // namespace hapticd::study
