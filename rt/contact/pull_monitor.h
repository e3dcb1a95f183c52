#pragma once

#include "hal/samples.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Notices a force that is a pull. As the tip leaves an object, a force that goes through zero and on in the
/// reverse direction is not an object's: the surface sticks to the tip, or the sensor's zero was taken while
/// the tool pressed. Such a force grows as that of a contact does, upside down, and must not be rendered.
class PullMonitor {
 public:
  /// An object pushes with `force_n`, the tip is at `tip_mm`.
  void remember(const hal::Vector3& force_n, const hal::Vector3& tip_mm) noexcept {
    force_n_ = force_n;
    tip_mm_ = tip_mm;
    pulls_ = false;
  }
  /// Whether `force_n` reverses the last push, at its place; from then on wherever the tip goes, until it is
  /// free or pushed again.
  bool is_pull(const hal::Vector3& force_n, const hal::Vector3& tip_mm) noexcept {
    pulls_ = dot(force_n, force_n_) < 0.0 && (pulls_ || norm(tip_mm - tip_mm_) < kSamePlaceMm);
    return pulls_;
  }
  /// The tip is free.
  void release() noexcept { pulls_ = false; }
  void reset() noexcept { *this = {}; }

 private:
  static constexpr double kSamePlaceMm = 2.0;

  hal::Vector3 force_n_;
  hal::Vector3 tip_mm_;
  bool pulls_ = false;
};

}  // namespace hapticd::rt
