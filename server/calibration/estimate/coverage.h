#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// What is calibrated.
enum class CalibrationKind : std::uint8_t {
  kTip,           ///< where the tip is on the tracked body: it turns about its tip
  kRegistration,  ///< where the rig is in the tracker's frame, and the latency
  kKinematics,    ///< that, and the device's joints, links and gimbal
};

/// One condition of the motion, and how much of it was done.
struct CoverageItem {
  std::string name;  ///< "joint_1_range"
  std::string unit;
  double value = 0.0;
  double required = 0.0;
  std::string instruction;  ///< what to do for more of it

  bool enough() const { return value >= required; }
};

/// What a calibration needs of the motion, most wanted first if it is not enough. Between the 2nd and the
/// 98th hundredth, so that one outlier covers nothing.
std::vector<CoverageItem> coverage_of(CalibrationKind kind, const RigStream& rig,
                                      const std::vector<ReferencePose>& reference);

/// 0 … 1, of all items together.
double completion_of(const std::vector<CoverageItem>& items);

}  // namespace hapticd::calibration
