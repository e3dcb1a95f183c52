#pragma once

#include "hal/samples.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// How much of a contact is rendered, from its beginning until nothing is left of it after the object let go
/// (drawn in docs/decisions.md). It is free, held by a contact, or fading after one.
///
/// Authority is the share times what the evidence of the contact allowed last: nothing comes back after a
/// release that was not rendered before it.
class ContactRelease {
 public:
  /// `is_cut`: nothing is rendered from the first tick without contact on (D§4.3.1).
  explicit ContactRelease(bool is_cut) noexcept : is_cut_(is_cut) {}

  /// Advances by one tick: what the evidence allows in contact, and the displacement as it is estimated.
  void update(bool in_contact, double authority, double displacement_mm,
              const TickInterval& interval) noexcept;
  /// Remembers the desired force of a tick in contact, before authority, and the reaction along the normal.
  void remember(const hal::Vector3& desired_n, double reaction_n = 0.0) noexcept {
    last_desired_n_ = desired_n;
    last_reaction_n_ = reaction_n;
  }
  void reset() noexcept { *this = ContactRelease(is_cut_); }

  /// False only if free.
  bool is_rendered() const noexcept { return share_ > 0.0; }
  /// Share of a force that is rendered, 0 … 1.
  double authority() const noexcept { return share_ * authority_; }
  /// Displacement that is rendered, 0 or more.
  double displacement_mm() const noexcept { return displacement_mm_; }
  /// Desired force of the last tick in contact.
  const hal::Vector3& last_desired_n() const noexcept { return last_desired_n_; }
  /// Reaction in that tick, 0 or more.
  double last_reaction_n() const noexcept { return last_reaction_n_; }

 private:
  bool is_cut_;
  double share_ = 0.0;
  double authority_ = 0.0;  ///< in the last tick of contact
  double displacement_mm_ = 0.0;
  hal::Vector3 last_desired_n_;
  double last_reaction_n_ = 0.0;
};

}  // namespace hapticd::rt
