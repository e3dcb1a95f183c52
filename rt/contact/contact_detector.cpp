#include "rt/contact/contact_detector.h"

#include <cmath>

namespace hapticd::rt {

void ContactDetector::reset() noexcept {
  in_contact_ = false;
  reason_ = ContactReason::kAwaitingFree;
  ticks_below_ = 0;
  ticks_free_ = 0;
}

bool ContactDetector::update(double force_n, double depth_mm, double contact_depth_mm) noexcept {
  const double magnitude = std::abs(force_n);
  just_left_surface_ = false;
  if (in_contact_) {
    ticks_below_ = magnitude < parameters_.release_ratio * parameters_.threshold_n ? ticks_below_ + 1 : 0;
    if (ticks_below_ >= parameters_.release_ticks) {
      in_contact_ = false;
      reason_ = ContactReason::kBelowRelease;
    } else if (depth_mm < contact_depth_mm - parameters_.release_clearance_mm) {
      in_contact_ = false;
      reason_ = ContactReason::kAboveSurface;
      just_left_surface_ = true;
      ticks_free_ = 0;
    } else {
      reason_ = ContactReason::kHeld;
    }
    return in_contact_;
  }
  const bool above = magnitude > parameters_.threshold_n;
  if (reason_ == ContactReason::kAwaitingFree) {
    ticks_free_ = above ? 0 : ticks_free_ + 1;
    if (ticks_free_ >= parameters_.free_ticks_to_arm) reason_ = ContactReason::kFree;
    return false;
  }
  if (reason_ == ContactReason::kAboveSurface) {
    // What still pulls up here is adhesion, or a filter that has not settled: no new contact before the force
    // has been quiet or the tip is back at the surface.
    ticks_free_ = above ? 0 : ticks_free_ + 1;
    const bool back = depth_mm > contact_depth_mm - 0.5 * parameters_.release_clearance_mm;
    if (!back && ticks_free_ < parameters_.release_ticks) return false;
  }
  if (above) {
    in_contact_ = true;
    ticks_below_ = 0;
    ++count_;
    reason_ = ContactReason::kAboveThreshold;
  } else {
    reason_ = ContactReason::kFree;
  }
  return in_contact_;
}

}  // namespace hapticd::rt
