#pragma once

#include <cstdint>
#include <string>

#include "server/identification/estimate/friction/friction_law_choice.h"
#include "server/identification/estimate/friction/friction_rows.h"

namespace hapticd::identification {

// Plane of conditions: what strokes up to 110 mm/s at three forces visit.
inline constexpr int kSpeedBins = 3;
inline constexpr double kMaxSpeedMmPerS = 120.0;
inline constexpr int kForceBins = 3;
inline constexpr double kMaxForceN = 6.0;
inline constexpr double kStrokeForceN[kForceBins] = {1.2, 3.0, 5.0};
inline constexpr std::uint32_t kEnoughPerCell = 50;

inline constexpr double kSlidingStrokeMmPerS = 10.0;
inline constexpr double kSteady = 0.03;

inline std::string in_newton(double force_n) {
  std::string text = std::to_string(force_n);
  return text.substr(0, text.find('.') + 2) + " N";
}
const char* words_of(FrictionForm form);

}  // namespace hapticd::identification
