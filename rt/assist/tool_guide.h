#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// A motion on which the device leads the tool, in a straight line.
struct GuideMotion {
  hal::Vector3 goal_mm;              ///< of the tip, rig frame
  double max_speed_mm_per_s = 15.0;  ///< D§3.4.1
  double max_force_n = 2.0;
  double timeout_s = 30.0;  ///< by the rig's time
};

/// The ranges of its parts, and what a motion is refused by.
namespace guide_range {
inline constexpr double kMinSpeedMmPerS = 1.0;
inline constexpr double kMaxSpeedMmPerS = 100.0;
inline constexpr double kMinForceN = 0.2;
inline constexpr double kMaxForceN = 4.0;
inline constexpr double kMaxTimeoutS = 600.0;
}  // namespace guide_range

/// Leads the tool to a point: f = k e + i + b (v_ref - v), e = p_ref - p, where p_ref runs along a
/// minimum-jerk path whose fastest part stays below the given speed, i is the slow integral of k e, and |f|
/// is bounded. A tool that lags holds p_ref back, so that there is nothing to catch up with faster than the
/// path goes. After its end the same law, with p_ref at rest, fades over 0.25 s.
///
/// First order in the tick's measured interval. Stable for an arm of 50 g and more at 1 kHz: b times the
/// delay of the smoothed velocity (7 ms) is 0.055 kg at most. A hand that first resists and then lets go
/// suddenly is pulled with the present force, faster than the given speed.
class ToolGuide {
 public:
  static constexpr double kStiffnessNPerMm = 0.2;
  static constexpr double kDampingNSPerMm = 0.006;
  static constexpr double kIntegralS = 0.4;
  static constexpr double kLetGoS = 0.25;
  static constexpr double kArrivedMm = 1.0;
  static constexpr double kArrivedS = 0.1;
  static constexpr double kResistedS = 0.5;
  /// The path's greatest speed as a share of the one that is given: a tool that sticks and slips is up to a
  /// quarter faster.
  static constexpr double kPathSpeed = 0.82;

  /// Begins from where the tip is with the next sample.
  void begin(const GuideMotion& motion) noexcept;
  /// Ends it, softly.
  void cancel() noexcept;

  struct Situation {
    hal::Vector3 tip_mm;
    hal::Vector3 velocity_mm_per_s;
    double interval_s = 0.0;  ///< since the last tick, > 0
    bool in_contact = false;
    bool is_force_allowed = true;
  };
  /// Force on the tip, rig frame.
  hal::Vector3 update(const Situation& now) noexcept;

  GuideState state() const noexcept { return state_; }
  /// Counts motions from 1.
  std::uint32_t number() const noexcept { return number_; }
  /// True while a motion is under way, or letting go.
  bool is_acting() const noexcept { return state_ == GuideState::kUnderWay || share_ > 0.0; }

 private:
  void start(const Situation& now) noexcept;
  void advance(const Situation& now) noexcept;
  void end(GuideState state) noexcept;
  GuideState judged(const Situation& now) noexcept;

  GuideMotion motion_;
  GuideState state_ = GuideState::kNone;
  std::uint32_t number_ = 0;
  bool is_started_ = false;
  bool was_free_ = false;  ///< since its start
  hal::Vector3 from_mm_;
  hal::Vector3 direction_;
  double length_mm_ = 0.0;
  double duration_s_ = 0.0;
  double progress_ = 0.0;  ///< of the time of the path, 0 … 1
  double elapsed_s_ = 0.0;
  double near_s_ = 0.0;      ///< within kArrivedMm
  double resisted_s_ = 0.0;  ///< at the greatest force
  hal::Vector3 reference_mm_;
  hal::Vector3 reference_mm_per_s_;
  hal::Vector3 integral_n_;
  hal::Vector3 force_n_;  ///< before the share
  double share_ = 0.0;
};

}  // namespace hapticd::rt
