#pragma once

#include <algorithm>

#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Takes the desired force to zero over 12 ms when a contact ends: fast enough that nothing is felt after the
/// contact, slow enough that what is left of the force does not knock. By then most of it has gone with the
/// reaction (ContactEvidence).
class ReleaseFade {
 public:
  static constexpr double kDurationS = 0.012;

  /// Passes `desired_force_n` on in contact and remembers it; afterwards fades out from the last one,
  /// linearly.
  double update(bool in_contact, double desired_force_n, const TickInterval& interval) noexcept {
    if (in_contact) {
      last_force_n_ = desired_force_n;
      share_ = 1.0;
      return desired_force_n;
    }
    share_ = std::max(0.0, share_ - interval.s / kDurationS);
    return share_ * last_force_n_;
  }
  void reset() noexcept { share_ = 0.0; }

 private:
  double share_ = 0.0;
  double last_force_n_ = 0.0;
};

}  // namespace hapticd::rt
