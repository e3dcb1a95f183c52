#pragma once

#include <string>
#include <vector>

#include "rt/scene/scene_spec.h"
#include "tests/measure/study/uncertainty/coverage.h"

namespace hapticd::study {

/// Errors of the displacement of some strokes, over the deviations in the telemetry.
struct StrokeCoverage {
  Coverage pressing;    ///< and stroking
  Coverage letting_go;  ///< less deep than seven tenths of the deepest so far
};

/// Strokes over an object of the current plant, with the model that the service identified of it.
StrokeCoverage stroke_coverage(const std::string& object, rt::Tip tip, const std::vector<double>& forces_n,
                               const std::vector<double>& speeds_mm_per_s);

}  // namespace hapticd::study
