#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/random.h"

namespace hapticd::sim {

/// What a tracker sends: where it saw the marker, in its own frame and by its own clock.
struct TrackerPose {
  std::int64_t stamp_ns = 0;
  hal::Vector3 position_mm;     ///< in whatever unit it sends
  hal::Quaternion orientation;  ///< marker coordinates into the tracker's
  bool has_orientation = true;
};

/// True places of things.
struct TrackerTruth {
  hal::Vector3 tracker_from_rig_mm;  ///< translation
  hal::Quaternion tracker_from_rig;
  hal::Vector3 marker_mm;  ///< from the tip, tool frame
  hal::Quaternion tool_from_marker;
};

/// A visual system: sees a marker on the tool a few times a second, late, with noise, now and then not at all
/// or somewhere else. Its place and how the marker is fixed are drawn by the seed. Has its own random stream:
/// nothing else changes for being watched.
class SimulatedTracker {
 public:
  SimulatedTracker(const Conditions& conditions, std::uint64_t seed) noexcept;

  bool there() const noexcept { return c_.tracker_rate_hz > 0.0; }
  const TrackerTruth& truth() const noexcept { return truth_; }

  /// Observes the true pose of the tip at a time of the rig's; for the clock's thread, at every tick.
  void observe(std::int64_t time_ns, const hal::Vector3& tip_mm, const hal::Quaternion& orientation) noexcept;
  /// Takes the next pose it sent; for one other thread.
  bool take(TrackerPose& pose) noexcept;

 private:
  void send(double time_s, const hal::Vector3& tip_mm, const hal::Quaternion& orientation) noexcept;

  Conditions c_;
  Random random_;
  TrackerTruth truth_;
  double next_s_ = 0.0;
  double hidden_until_s_ = 0.0;
  bool seen_before_ = false;
  double before_s_ = 0.0;
  hal::Vector3 before_mm_;
  hal::Quaternion before_;
  std::optional<TrackerPose> frozen_;

  static constexpr std::size_t kCapacity = 1024;  ///< a few seconds; what is not taken is lost
  std::array<TrackerPose, kCapacity> sent_{};
  std::atomic<std::size_t> pushed_{0};
  std::atomic<std::size_t> popped_{0};
};

}  // namespace hapticd::sim
