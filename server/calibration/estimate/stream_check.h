#pragma once

#include <optional>
#include <vector>

#include "hal/error.h"
#include "server/calibration/estimate/arm_fit.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// Checks what is wrong with a tracker's poses, before anything is fitted to them: too few, stamps that go
/// back or jump, a tracker that froze or does not see the device, another unit, a left-handed frame, axes
/// swapped, orientations that follow something else or are written in another order. The first that is found;
/// nothing if they are fit for use.
std::optional<hal::Error> check_stream(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                       const ArmFitSettings& settings);

}  // namespace hapticd::calibration
