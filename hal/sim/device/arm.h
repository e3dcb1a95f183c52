#pragma once

#include "hal/samples.h"

namespace hapticd::sim {

/// The linkage of the simulated device: a base that turns, two links, a gimbal. Only its angles are of
/// interest: the dynamics are those of the tip.
struct Arm {
  double first_link_mm = 215.0;
  double second_link_mm = 170.0;
};

/// The angles with which the arm has its tip and its tool in a pose of the rig frame. All are zero at the
/// origin with the tool upright; the first link then lies level and points to the rig's y, the second hangs.
///
/// Joints: turn of the base to the left, rise of the first link, swing of the second one forward, both from
/// the level. Gimbal: about the second link's own up, then across, then along. Out of reach: stretched as far
/// as it goes.
hal::DeviceAngles angles_of(const Arm& arm, const hal::Vector3& tip_mm,
                            const hal::Quaternion& orientation) noexcept;

}  // namespace hapticd::sim
