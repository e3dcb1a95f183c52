#pragma once

#include "rt/contact/free_motion_residual.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_compensation.h"
#include "tests/measure/study/precision/detection/detection_traces.h"

namespace hapticd::study {

/// What a threshold may be put to, one number a tick; all are judged by the same rt::ContactDetector.
///
/// The one that hapticd ships first. Each has
///   double update(const DetectionTick&, bool in_contact);  void left_surface();

/// rt::FreeMotionResidual, as a scene uses it.
class MatchedInertia {
 public:
  explicit MatchedInertia(double rate_hz) noexcept : residual_(kDetectionToolG, rate_hz) {}
  double update(const DetectionTick& tick, bool in_contact) noexcept {
    return residual_.update(tick.force_n, tick.depth_mm, tick.time_ns, in_contact);
  }
  void left_surface() noexcept { residual_.assume_free(); }

 private:
  rt::FreeMotionResidual residual_;
};

/// f_r of (3.4), the acceleration through 50 Hz.
class PublishedReaction {
 public:
  PublishedReaction(double resolution_mm, double rate_hz) noexcept : motion_(resolution_mm, rate_hz) {}
  double update(const DetectionTick& tick, bool) noexcept {
    motion_.update(tick.depth_mm, tick.time_ns);
    return rt::reaction_force_n(tick.force_n, kDetectionToolG, motion_.acceleration_mm_per_s2());
  }
  void left_surface() noexcept {}

 private:
  rt::MotionEstimator motion_;
};

/// f_s as it is: the tool's inertia counts as contact.
struct RawForce {
  double update(const DetectionTick& tick, bool) noexcept { return tick.force_n; }
  void left_surface() noexcept {}
};

}  // namespace hapticd::study
