#pragma once

#include <cstdint>

#include "rt/scene/tick_record.h"

namespace hapticd::rt {

/// Threshold detection of D§3.2 with release hysteresis.
struct ContactParameters {
  double threshold_n = 0.015;            ///< ε_f
  double release_ratio = 0.5;            ///< release level as a fraction of ε_f
  std::uint32_t release_ticks = 5;       ///< consecutive ticks below it; one noisy sample ends no contact
  std::uint32_t free_ticks_to_arm = 20;  ///< ticks within ε_f before the first contact may be declared
};

/// Contact state from the reaction force, one tick at a time.
class ContactDetector {
 public:
  explicit ContactDetector(const ContactParameters& parameters) noexcept : parameters_(parameters) {}

  /// Feeds |f_r|; returns the state after this tick.
  bool update(double reaction_force_n) noexcept;
  void reset() noexcept;

  bool in_contact() const noexcept { return in_contact_; }
  bool just_declared() const noexcept { return reason_ == ContactReason::kAboveThreshold; }
  ContactReason reason() const noexcept { return reason_; }
  std::uint32_t count() const noexcept { return count_; }

 private:
  ContactParameters parameters_;
  ContactReason reason_ = ContactReason::kAwaitingFree;
  bool in_contact_ = false;
  std::uint32_t ticks_below_ = 0;
  std::uint32_t ticks_free_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace hapticd::rt
