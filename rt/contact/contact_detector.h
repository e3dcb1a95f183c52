#pragma once

#include <cstdint>

#include "rt/contact/contact_evidence.h"
#include "rt/contact/zero_tracker.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// Force to which the threshold is applied.
enum class ContactMethod : std::uint8_t {
  kMatchedInertia,        ///< FreeMotionResidual: free motion leaves nothing behind
  kFilteredAcceleration,  ///< f_r of (3.4) as published: what the 50 Hz filter lags behind counts as contact
};

/// Threshold detection of D§3.2 with release hysteresis.
struct ContactParameters {
  ContactMethod method = ContactMethod::kMatchedInertia;
  double threshold_n = 0.015;         ///< ε_f; in a scene 0 = the rig's, else 0.015, in 3D 0.02
  double release_ratio = 0.5;         ///< release level as a fraction of ε_f
  double release_time_ms = 5.0;       ///< below it without a break; one noisy sample ends no contact
  double release_clearance_mm = 0.5;  ///< so far back past the contact point there is no object any more
  double quiet_time_ms = 100.0;       ///< within ε_f, before a contact away from the last one may follow it
  double arming_time_ms = 20.0;       ///< within ε_f before the first contact may be declared
  EvidenceParameters evidence{};
  double zero_bound_n = 0.25;  ///< how far the sensor's zero is followed from its bias; 0 = not at all
};

/// Contact state from force and depth, one tick at a time. What it counts is looks at the force, not time: a
/// late tick brings one look, however long it took.
class ContactDetector {
 public:
  /// `rate_hz`: of the loop; what `parameters` count becomes so many of its ticks.
  ContactDetector(const ContactParameters& parameters, double rate_hz) noexcept;

  /// Takes a tick. `force_n`: what free motion leaves at zero. `depth_mm`: along the press axis, growing into
  /// the object; from `contact_depth_mm`, where the present contact began. `uncertain_n`: by how much more
  /// than ε_f the force must be for a contact to be declared. `may_begin`: false if this force cannot be that
  /// of an object that is met. Returns the state after this tick.
  bool update(double force_n, double depth_mm, double contact_depth_mm, double uncertain_n = 0.0,
              bool may_begin = true) noexcept;
  /// The sensor is noisier than a quiet one, by so much: the threshold is that much higher.
  void set_excess_noise(double noise_n) noexcept { noise_n_ = noise_n; }
  /// ε_f on this sensor.
  double threshold_n() const noexcept { return parameters_.threshold_n + noise_n_; }
  /// Declares contact from this tick on: a contact law knows of an onset that was missed.
  void declare() noexcept;
  /// Withdraws the contact: there was no object, and the tip is free once the force has been within ε_f. A
  /// tool that bounces comes down before that has lasted the arming time: what exceeds all that a sensor may
  /// read without load within 30 ms after the force was within ε_f is a contact.
  void withdraw() noexcept;
  /// The object is gone from under the tip.
  void lose() noexcept;
  /// Whether something is touched is not known: no contact before the force has been within ε_f.
  void await_free() noexcept;
  void reset() noexcept { await_free(); }

  bool in_contact() const noexcept { return in_contact_; }
  bool just_declared() const noexcept { return reason_ == ContactReason::kAboveThreshold; }
  bool just_left_surface() const noexcept { return reason_ == ContactReason::kAboveSurface; }
  ContactReason reason() const noexcept { return reason_; }
  /// Free, and known to be.
  bool is_free() const noexcept { return !in_contact_ && !is_waiting(); }
  /// True while there is no contact, but none may be declared yet.
  bool is_waiting() const noexcept {
    return reason_ == ContactReason::kAwaitingFree || reason_ == ContactReason::kWithdrawn;
  }
  /// True if `force_n`, what the sensor reads without the tool's own load, shows its zero. It does while it is within
  /// ε_f and the tool is free, or has been within ε_f for as long as it takes to become free; also if what was taken
  /// for a contact turned out not to be one.
  bool zero_shows(double force_n) const noexcept {
    if (reason_ == ContactReason::kWithdrawn) return force_n < ZeroTracker::kMaxErrorN;
    const bool is_quiet = is_free() || ticks_within_ >= arming_ticks_;
    return is_quiet && ticks_disturbed_ == 0 && force_n < threshold_n();
  }
  /// Contacts so far that turned out to be none.
  std::uint32_t withdrawn_count() const noexcept { return withdrawn_count_; }
  /// Ticks under force since a release, away from the last surface: the tool rests on something of unknown
  /// depth.
  std::uint32_t disturbed_ticks() const noexcept { return ticks_disturbed_; }
  std::uint32_t count() const noexcept { return count_; }

 private:
  static constexpr double kMaxDisturbanceS = 1.0;
  static constexpr double kRingingS =
      0.015;  ///< after an object threw the tip off, its force is none of contact

  static constexpr std::uint32_t kFlightTicks = 2;  ///< within ε_f: a force that crosses it does not count as
                                                    ///< flight
  /// Time, no longer than onsets are looked back for; what grows more slowly began unseen.
  static constexpr double kLandingS = 0.03;

  void release(ContactReason reason) noexcept;

  ContactParameters parameters_;
  std::uint32_t release_ticks_;
  std::uint32_t quiet_ticks_;
  std::uint32_t arming_ticks_;
  std::uint32_t longest_disturbance_ticks_;
  std::uint32_t ringing_ticks_;
  std::uint32_t landing_ticks_;
  double evident_n_;
  double noise_n_ = 0.0;
  ContactReason reason_ = ContactReason::kAwaitingFree;
  bool in_contact_ = false;
  bool recently_released_ = false;
  std::uint32_t ticks_ringing_ = 0;  ///< left, since the reaction was lost
  std::uint32_t ticks_below_ = 0;
  std::uint32_t ticks_free_ = 0;
  std::uint32_t ticks_within_ = 0;  ///< ε_f out of contact, whatever is waited for; up to arming_ticks_
  std::uint32_t ticks_since_quiet_;  ///< while withdrawn, up to landing_ticks_
  std::uint32_t ticks_disturbed_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t withdrawn_count_ = 0;
};

}  // namespace hapticd::rt
