#pragma once

#include <cstdint>

#include "rt/scene/tick_record.h"

namespace hapticd::rt {

/// Which force the threshold is applied to.
enum class ContactMethod : std::uint8_t {
  kMatchedInertia,        ///< FreeMotionResidual: free motion leaves nothing behind
  kFilteredAcceleration,  ///< f_r of (3.4) as published: what the 50 Hz filter lags behind counts as contact
};

/// Threshold detection of D§3.2 with release hysteresis.
struct ContactParameters {
  static constexpr double kCountedAtHz = 1000.0;

  ContactMethod method = ContactMethod::kMatchedInertia;
  double threshold_n = 0.015;  ///< ε_f; in a scene 0 = the rig's, else 0.015, in 3D 0.02
  double release_ratio = 0.5;  ///< release level as a fraction of ε_f
  /// The counts are those of a loop at kCountedAtHz; at another rate they last as long.
  std::uint32_t release_ticks = 5;    ///< consecutive ticks below it; one noisy sample ends no contact
  double release_clearance_mm = 0.5;  ///< so far back past the contact point there is no object any more
  std::uint32_t quiet_ticks_after_release =
      100;  ///< within ε_f, before a contact away from the last one may follow it
  std::uint32_t free_ticks_to_arm = 20;  ///< ticks within ε_f before the first contact may be declared
};

/// Contact state from force and depth, one tick at a time.
class ContactDetector {
 public:
  /// `rate_hz`: of the loop; what `parameters` count becomes so many of its ticks.
  ContactDetector(const ContactParameters& parameters, double rate_hz) noexcept;

  /// `force_n`: what free motion leaves at zero. `depth_mm`: along the press axis, growing into the object;
  /// from `contact_depth_mm`, where the present contact began. Returns the state after this tick.
  bool update(double force_n, double depth_mm, double contact_depth_mm) noexcept;
  /// Somebody knows better: in contact from this tick on.
  void declare() noexcept;
  void reset() noexcept;

  bool in_contact() const noexcept { return in_contact_; }
  bool just_declared() const noexcept { return reason_ == ContactReason::kAboveThreshold; }
  bool just_left_surface() const noexcept { return reason_ == ContactReason::kAboveSurface; }
  ContactReason reason() const noexcept { return reason_; }
  /// Ticks under force since a release, away from the last surface: the tool rests on something, but nobody
  /// knows how deep.
  std::uint32_t disturbed_ticks() const noexcept { return ticks_disturbed_; }
  std::uint32_t count() const noexcept { return count_; }

 private:
  static constexpr double kLongestDisturbanceS = 1.0;

  void release(ContactReason reason) noexcept;

  ContactParameters parameters_;
  std::uint32_t release_ticks_;
  std::uint32_t quiet_ticks_;
  std::uint32_t arming_ticks_;
  std::uint32_t longest_disturbance_ticks_;
  ContactReason reason_ = ContactReason::kAwaitingFree;
  bool in_contact_ = false;
  bool recently_released_ = false;
  std::uint32_t ticks_below_ = 0;
  std::uint32_t ticks_free_ = 0;
  std::uint32_t ticks_disturbed_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace hapticd::rt
