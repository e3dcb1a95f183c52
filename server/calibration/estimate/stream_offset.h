#pragma once

#include <optional>
#include <vector>

#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// By how much a tracker's stamps are later than the rig's clock had it, roughly.
struct StreamOffset {
  double offset_s = 0.0;
  double correlation = 0.0;  ///< of both speeds, there
};

/// Of the two speeds; below it, the tracker does not see the device move.
inline constexpr double kMinCorrelation = 0.3;

/// Where the speeds of marker and tip are most alike, between the two offsets. Needs neither the frames nor
/// the unit of the tracker. Nothing where too few poses fall together.
std::optional<StreamOffset> find_offset(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                        double from_s, double to_s);

/// The same where nothing is known of the two clocks: over all offsets at which half of the tracker's poses
/// fall into the rig's. Nothing where the rig's are of more than an hour.
std::optional<StreamOffset> find_any_offset(const RigStream& rig,
                                            const std::vector<ReferencePose>& reference);

}  // namespace hapticd::calibration
