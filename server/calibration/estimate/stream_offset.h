#pragma once

#include <optional>
#include <vector>

#include "hal/lock/callback.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// Time by which a tracker's stamps are later than the rig's clock had it, roughly.
struct StreamOffset {
  double offset_s = 0.0;
  double correlation = 0.0;  ///< of both speeds, there
};

/// Correlation of the two speeds below which the tracker does not see the device move.
inline constexpr double kMinCorrelation = 0.3;

/// Offset at which the speeds of marker and tip are most alike, between the two offsets. Needs neither the
/// frames nor the unit of the tracker. Nothing if too few poses fall together, or once it is given up.
std::optional<StreamOffset> find_offset(
    const RigStream& rig, const std::vector<ReferencePose>& reference, double from_s, double to_s,
    const Callback<bool()>& given_up = [] { return false; });

/// Offset if nothing is known of the two clocks: over all offsets at which half of the tracker's poses fall
/// into the rig's. Nothing if the rig's poses are of more than an hour, or once it is given up.
std::optional<StreamOffset> find_any_offset(
    const RigStream& rig, const std::vector<ReferencePose>& reference,
    const Callback<bool()>& given_up = [] { return false; });

}  // namespace hapticd::calibration
