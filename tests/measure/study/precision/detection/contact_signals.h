#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/contact/free_motion_residual.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_compensation.h"
#include "tests/measure/study/precision/detection/detection_traces.h"

namespace hapticd::study {

/// What a threshold may be put to, one number a tick; all are judged by the same rt::ContactDetector.
///
/// The two that hapticd ships first; the others are candidates. Each has
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

/// Mean of the last N numbers; the first fills it.
template <std::size_t N>
class MovingMean {
 public:
  double update(double value) noexcept {
    if (!started_) {
      values_.fill(value);
      sum_ = value * N;
      started_ = true;
    }
    sum_ += value - values_[next_];
    values_[next_] = value;
    next_ = (next_ + 1) % N;
    return sum_ / N;
  }

 private:
  bool started_ = false;
  std::size_t next_ = 0;
  double sum_ = 0.0;
  std::array<double, N> values_{};
};

/// f_r of (3.4), the mean of the last five ticks: less noise, two ticks later.
class AveragedReaction {
 public:
  AveragedReaction(double resolution_mm, double rate_hz) noexcept : reaction_(resolution_mm, rate_hz) {}
  double update(const DetectionTick& tick, bool in_contact) noexcept {
    return mean_.update(reaction_.update(tick, in_contact));
  }
  void left_surface() noexcept {}

 private:
  PublishedReaction reaction_;
  MovingMean<5> mean_;
};

/// f_s against its own mean of the last 20 ms: inertia is slow, an impact is not. Needs no position.
class ForceStep {
 public:
  double update(const DetectionTick& tick, bool) noexcept {
    return tick.force_n - mean_.update(tick.force_n);
  }
  void left_surface() noexcept {}

 private:
  MovingMean<20> mean_;
};

/// One-sided cumulative sum of Page (1954) on f_r of (3.4): g⁺ = max(0, g + |f_r| - ν), in newtons times
/// ticks. ν: what free motion leaves, on average twice.
class CumulativeSum {
 public:
  CumulativeSum(double drift_n, double resolution_mm, double rate_hz) noexcept
      : drift_n_(drift_n), reaction_(resolution_mm, rate_hz) {}
  double update(const DetectionTick& tick, bool in_contact) noexcept {
    sum_ = std::max(0.0, sum_ + std::abs(reaction_.update(tick, in_contact)) - drift_n_);
    return sum_;
  }
  void left_surface() noexcept { sum_ = 0.0; }

 private:
  double drift_n_;
  PublishedReaction reaction_;
  double sum_ = 0.0;
};

/// Force and inertia through the same filter, but without adding back the force's lead: what
/// rt::FreeMotionResidual would be without its dead zone. Two 40 Hz sections, ticks of even length.
class MatchedWithoutLead {
 public:
  explicit MatchedWithoutLead(double rate_hz) noexcept
      : rate_hz_(rate_hz), first_(40.0, rate_hz), second_(40.0, rate_hz) {}
  double update(const DetectionTick& tick, bool) noexcept {
    if (known_ < 2) {
      const double here = tick.depth_mm;
      if (known_++ == 0) before_mm_ = here;
      last_mm_ = here;
      last_force_n_ = tick.force_n;
      return 0.0;
    }
    const double acceleration = (tick.depth_mm - 2.0 * last_mm_ + before_mm_) * rate_hz_ * rate_hz_;
    const double aligned_n = 0.5 * (tick.force_n + last_force_n_);
    before_mm_ = last_mm_;
    last_mm_ = tick.depth_mm;
    last_force_n_ = tick.force_n;
    return second_.update(first_.update(rt::reaction_force_n(aligned_n, kDetectionToolG, acceleration)));
  }
  void left_surface() noexcept {}

 private:
  double rate_hz_;
  rt::ButterworthLowPass first_, second_;
  int known_ = 0;
  double before_mm_ = 0.0;
  double last_mm_ = 0.0;
  double last_force_n_ = 0.0;
};

}  // namespace hapticd::study
