#pragma once

#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/press.h"

namespace hapticd::study {

/// The objects of D§3.
inline const std::vector<std::string>& tapped_objects() {
  static const std::vector<std::string> names{"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"};
  return names;
}

/// A press to `force_n` in the scene `tap_1d`, held for three seconds; the last of them is judged.
PressTask tap_press(const std::string& device, const std::string& object, double target, bool compensated,
                    double force_n);

}  // namespace hapticd::study
