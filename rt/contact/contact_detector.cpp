#include "rt/contact/contact_detector.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/ticks.h"

namespace hapticd::rt {

ContactDetector::ContactDetector(const ContactParameters& parameters, double rate_hz) noexcept
    : parameters_(parameters),
      release_ticks_(ticks_of(1e-3 * parameters.release_time_ms, rate_hz)),
      quiet_ticks_(ticks_of(1e-3 * parameters.quiet_time_ms, rate_hz)),
      arming_ticks_(ticks_of(1e-3 * parameters.arming_time_ms, rate_hz)),
      longest_disturbance_ticks_(ticks_of(kMaxDisturbanceS, rate_hz)),
      ringing_ticks_(ticks_of(kRingingS, rate_hz)),
      landing_ticks_(ticks_of(kLandingS, rate_hz)),
      evident_n_(2.0 * (parameters.evidence.unexplained_force_n > 0.0
                            ? parameters.evidence.unexplained_force_n
                            : default_unexplained_force_n(parameters.threshold_n))),
      ticks_since_quiet_(landing_ticks_) {}

void ContactDetector::await_free() noexcept {
  in_contact_ = false;
  reason_ = ContactReason::kAwaitingFree;
  recently_released_ = false;
  ticks_since_quiet_ = landing_ticks_;
  ticks_below_ = 0;
  ticks_free_ = 0;
  ticks_disturbed_ = 0;
}

void ContactDetector::withdraw() noexcept {
  await_free();
  reason_ = ContactReason::kWithdrawn;
  ++withdrawn_count_;
}

void ContactDetector::release(ContactReason reason) noexcept {
  in_contact_ = false;
  reason_ = reason;
  ticks_free_ = 0;
  ticks_disturbed_ = 0;
  recently_released_ = true;
  ticks_ringing_ = 0;
}

void ContactDetector::lose() noexcept {
  release(ContactReason::kReactionLost);
  ticks_ringing_ = ringing_ticks_;
}

void ContactDetector::declare() noexcept {
  in_contact_ = true;
  ticks_within_ = 0;
  recently_released_ = false;
  ticks_below_ = 0;
  ticks_disturbed_ = 0;
  ++count_;
  reason_ = ContactReason::kAboveThreshold;
}

bool ContactDetector::update(double force_n, double depth_mm, double contact_depth_mm, double uncertain_n,
                             bool may_begin) noexcept {
  const double magnitude = std::abs(force_n);
  const double clearance_mm = parameters_.release_clearance_mm;
  if (in_contact_) {
    ticks_below_ = magnitude < parameters_.release_ratio * threshold_n() ? ticks_below_ + 1 : 0;
    if (ticks_below_ >= release_ticks_) {
      release(ContactReason::kBelowRelease);
    } else if (depth_mm < contact_depth_mm - clearance_mm) {
      release(ContactReason::kAboveSurface);
    } else {
      reason_ = ContactReason::kHeld;
    }
    return in_contact_;
  }

  const bool above = magnitude > threshold_n() + uncertain_n;
  ticks_free_ = above ? 0 : ticks_free_ + 1;
  ticks_within_ = above ? 0 : std::min(ticks_within_ + 1, arming_ticks_);
  if (is_waiting()) {
    // What stays beyond all that a sensor may read of nothing is something after all, of unknown depth.
    const bool is_evident = reason_ == ContactReason::kWithdrawn && magnitude > evident_n_;
    ticks_disturbed_ = is_evident ? ticks_disturbed_ + 1 : 0;
    ticks_since_quiet_ = ticks_free_ >= kFlightTicks ? 0 : std::min(ticks_since_quiet_ + 1, landing_ticks_);
    if (ticks_free_ >= arming_ticks_) {
      reason_ = ContactReason::kFree;
    } else if (is_evident && ticks_since_quiet_ < landing_ticks_) {
      declare();
    }
    return in_contact_;
  }
  if (recently_released_) {
    // What still pulls here is adhesion, or the structure ringing from the impact: no new contact before the
    // tip is back at the surface or all has been quiet for a while.
    if (ticks_ringing_ > 0) --ticks_ringing_;
    const double back_mm = (ticks_ringing_ > 0 ? 0.5 : -0.5) * clearance_mm;
    const bool back = depth_mm > contact_depth_mm + back_mm;
    recently_released_ = !back && ticks_free_ < quiet_ticks_;
    // Force that stays this long is neither: the tool rests on something whose surface is not where the last
    // contact left it, and where it is now cannot be known before the tool was free.
    ticks_disturbed_ = recently_released_ && above ? ticks_disturbed_ + 1 : 0;
    if (ticks_disturbed_ > longest_disturbance_ticks_) {
      await_free();
      return false;
    }
  }
  if (above && may_begin && !recently_released_) {
    declare();
  } else {
    reason_ = ContactReason::kFree;
  }
  return in_contact_;
}

}  // namespace hapticd::rt
