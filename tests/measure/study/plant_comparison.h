#pragma once

#include <string>

#include "tests/measure/report/report.h"

namespace hapticd::study {

/// Puts the two plants side by side: a row for each figure of the folder and each combination of its
/// conditions that are words (but for the object, over which it ranges, as over all that are numbers). Writes
/// plants.md if there are figures of both.
void compare_plants(report::Report& report, const std::string& section);

}  // namespace hapticd::study
