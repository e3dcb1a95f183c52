#pragma once

#include "hal/samples.h"
#include "rt/modulation/transient_waveform.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Makes the first 100 ms of a contact feel like another material: at each contact a bank of decaying
/// sinusoids in the acceleration of the grip, as large as the impact was fast, less what the object gives by
/// itself (Kuchenbecker 2006: acceleration matching).
///
/// The transient begins when the contact's evidence first allows a force, and is scaled by what is left of
/// that: in free air nothing is felt. Once begun it is fixed: no loop is closed, so it cannot make a contact
/// unstable. Bounds, by its scale alone, so that its shape stays:
///   force    max_force_n, and its change within half of what the guard lets pass
///   energy   ½ m v² of device, tool and grip at the impact: no more than the impact brought
///   time     100 ms, the last 20 of them fading; none within kQuietS after a contact, a bounce is one impact
/// A gap in the samples ends it.
class ContactTransient {
 public:
  static constexpr double kQuietS = 0.08;
  static constexpr double kMinSpeedMmPerS = 10.0;
  static constexpr double kAwaitS = 0.02;  ///< for the evidence; later the impact is over

  /// `max_change_n`: within a tick.
  ContactTransient(const TransientParameters& transient, const GripPlant& plant, double max_change_n,
                   double rate_hz);

  struct Input {
    bool in_contact = false;
    bool just_declared = false;
    double authority = 0.0;          ///< share of the force that may be rendered, 0 … 1
    double approach_mm_per_s = 0.0;  ///< into the object
    hal::Vector3 normal;             ///< out of the object, length 1
    TickInterval interval;
  };

  /// Force to add to the command. Zero for an input that is not a number.
  hal::Vector3 update(const Input& now) noexcept;
  void reset() noexcept;

  bool is_running() const noexcept { return is_running_; }
  double force_n() const noexcept { return force_n_; }  ///< along the normal
  double impact_mm_per_s() const noexcept { return impact_mm_per_s_; }
  /// Share of the amplitude that was asked for, 0 … 1: what the bounds left.
  double amplitude_share() const noexcept { return share_; }
  std::uint32_t count() const noexcept { return count_; }

 private:
  void begin(const Input& now) noexcept;

  TransientWaveform waveform_;
  bool needs_evidence_;
  double max_force_n_;
  double max_change_n_;
  double mass_kg_;
  double rate_hz_;
  bool awaits_ = false;  ///< a contact has begun
  bool is_running_ = false;
  double awaited_s_ = 0.0;
  double free_s_ = 1.0;  ///< since the last contact or transient
  double impact_mm_per_s_ = 0.0;
  double speed_mm_per_s_ = 0.0;  ///< that the waveform is scaled by, after all bounds
  double share_ = 0.0;
  double max_authority_ = 0.0;
  double late_ticks_ = 0.0;  ///< measured, not rendered yet
  double force_n_ = 0.0;
  hal::Vector3 normal_;
  std::uint32_t count_ = 0;
};

}  // namespace hapticd::rt
