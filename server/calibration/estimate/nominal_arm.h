#pragma once

#include <vector>

#include "rt/arm/arm_model.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// The arm that a device takes itself for.
struct NominalArm {
  rt::ArmModel arm;
  double position_rms_mm = 0.0;      ///< between the reported positions and the arm's
  double orientation_rms_rad = 0.0;  ///< likewise, of the gimbal
  double condition = 0.0;  ///< smallest over largest singular value of the start: how well it is determined
};

/// Finds the arm from what the device reports: its positions and orientations are a function of its angles,
/// whatever their zeros and signs. Position: base, link lengths, signs and zeros of joints 2 and 3; zero of
/// joint 1 is the base's. Orientation: signs of the gimbal's angles and zeros of the first two, if it turns
/// about the second link, across, and along the tool. If they are not such a function, `use` says so and the
/// reported poses have to serve. At least 50 poses.
NominalArm find_nominal_arm(const std::vector<RigPose>& poses);

}  // namespace hapticd::calibration
