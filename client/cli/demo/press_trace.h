#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// One moment of a press, as it truly was (not as it was estimated).
struct PressPoint {
  double time_s = 0.0;
  double displacement_mm = 0.0;
  double hand_force_n = 0.0;  ///< of the hand, into the object
  bool in_contact = false;
};

/// One press of the simulated hand, from before it touches until it has let go.
class PressTrace {
 public:
  /// Takes the truth of a sample; samples without it are passed over.
  void add(const v1::TelemetrySample& sample);

  bool touched() const noexcept { return touched_; }
  /// True when the tip touched and has been off the object for a moment.
  bool over() const noexcept;
  const std::vector<PressPoint>& points() const noexcept { return points_; }

 private:
  std::vector<PressPoint> points_;
  bool touched_ = false;
  double released_since_s_ = -1.0;  ///< negative: not released
};

/// What the hand felt once the press had settled.
struct SettledHold {
  double duration_s = 0.0;  ///< of the part that was averaged
  double hand_force_n = 0.0;
  double displacement_mm = 0.0;
  double stiffness_n_per_mm() const { return hand_force_n / displacement_mm; }
};

/// Point at which a press was let go of: the last one at which the tip touched before it came free for the
/// first time on the way up. An object that recovers more slowly than the hand lifts is left at depth, with
/// force on the hand.
struct ReleasePoint {
  std::size_t index = 0;  ///< among the points of the press
  double displacement_mm = 0.0;
  double hand_force_n = 0.0;
};

/// Nothing if the tip never touched, or touches to the end.
std::optional<ReleasePoint> release_point(const std::vector<PressPoint>& points);

/// Means over the second half of the time at full force. Nothing when the force was not held for 0.2 s, or
/// still drifts.
std::optional<SettledHold> settled_hold(const std::vector<PressPoint>& points);

}  // namespace hapticd::cli
