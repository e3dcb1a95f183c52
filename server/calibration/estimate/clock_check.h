#pragma once

#include <optional>
#include <vector>

#include "hal/error.h"
#include "server/calibration/estimate/arm_fit.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// Checks whether the tracker's clock jumps by more than 80 ms: the frame and the offset of the stream's
/// first seconds against those of the others. Nothing if even those follow no rigid motion.
std::optional<hal::Error> check_jump(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                     const ArmFitSettings& settings);

/// Checks what a fit shows of the tracker's clock: a jump of some milliseconds, or a clock that runs at
/// another speed although none was estimated.
std::optional<hal::Error> check_clock(const ArmFit& fit);

}  // namespace hapticd::calibration
