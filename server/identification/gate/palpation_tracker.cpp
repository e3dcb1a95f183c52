#include "server/identification/gate/palpation_tracker.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/ticks.h"
#include "rt/signal/tool_compensation.h"
#include "server/identification/gate/sample_policy.h"

namespace hapticd::identification {

namespace {
rt::ContactParameters with_threshold(double threshold_n) noexcept {
  rt::ContactParameters parameters;
  parameters.threshold_n = threshold_n;
  return parameters;
}
}  // namespace

PalpationTracker::PalpationTracker(double tool_mass_g, double threshold_n, double position_resolution_mm,
                                   double rate_hz) noexcept
    : tool_mass_g_(tool_mass_g),
      threshold_n_(threshold_n),
      contact_(with_threshold(threshold_n), rate_hz),
      residual_(tool_mass_g, rate_hz),
      onset_(rate_hz),
      motion_(position_resolution_mm, rate_hz),
      settling_ticks_(rt::ticks_of(kPalpationSettlingS, rate_hz)),
      ticks_since_restart_(settling_ticks_) {}

void PalpationTracker::restart() noexcept {
  residual_.reset();
  onset_.forget();
  motion_.reset();
  // If the surface is known, a gap leaves the contact what it was: force and depth show in the next ticks
  // whether it began or ended meanwhile.
  if (!touched_) contact_.reset();
  ticks_since_restart_ = 0;
}

PalpationSample PalpationTracker::update(const hal::RigSample& sample) noexcept {
  const double depth_mm = -sample.tip_position_mm.z;
  const double force_n = sample.sensor_force_n.z;
  if (!settled()) ++ticks_since_restart_;
  motion_.update(depth_mm, sample.time_ns);
  const double r = residual_.update(force_n, depth_mm, sample.time_ns, contact_.in_contact());
  onset_.remember(depth_mm, residual_.prompt_force_n());
  contact_.update(r, depth_mm, surface_mm_);
  // The first touch of the rested object says where its surface is.
  if (contact_.just_declared() && !touched_) {
    surface_mm_ = onset_.place_mm(0.5 * threshold_n_ + residual_.seen_jerk_n());
    touched_ = true;
  }
  PalpationSample out;
  out.in_contact = contact_.in_contact();
  out.displacement_mm = touched_ ? depth_mm - surface_mm_ : -1.0;
  out.rate_mm_per_s = motion_.velocity_mm_per_s();
  out.normal_force_n = rt::reaction_force_n(force_n, tool_mass_g_, motion_.acceleration_mm_per_s2());
  out.time_s = 1e-9 * static_cast<double>(sample.time_ns);
  return out;
}

RecordedPalpation::RecordedPalpation(double threshold_n, double rate_hz) noexcept
    : threshold_n_(threshold_n) {
  // About 20 ms, as the window of the live velocity; no fewer than a parabola needs to be more than drawn
  // through.
  const double wanted = 0.02 * std::clamp(rate_hz, 1.0, 1e5);
  window_ = 2 * static_cast<std::size_t>(std::clamp(wanted / 2.0, 2.0, 10.0)) + 1;
}

double RecordedPalpation::slope_at_centre() const noexcept {
  // Moments about the centre, times scaled by the half-width.
  const auto at = [&](std::size_t age) -> const Moment& { return ring_[(newest_ + kMax - age) % kMax]; };
  const Moment& centre = at(window_ / 2);
  const double width_s = 0.5 * (at(0).time_s - at(window_ - 1).time_s);
  double s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, b0 = 0.0, b1 = 0.0, b2 = 0.0;
  for (std::size_t age = 0; age < window_; ++age) {
    const double t = (at(age).time_s - centre.time_s) / width_s;
    const double y = at(age).depth_mm - centre.depth_mm;
    s1 += t;
    s2 += t * t;
    s3 += t * t * t;
    s4 += t * t * t * t;
    b0 += y;
    b1 += t * y;
    b2 += t * t * y;
  }
  const double s0 = static_cast<double>(window_);
  // Cramer's rule for the linear coefficient.
  const double determinant = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2);
  const double linear = s0 * (b1 * s4 - b2 * s3) - b0 * (s1 * s4 - s2 * s3) + s2 * (s1 * b2 - s2 * b1);
  return linear / determinant / width_s;
}

bool RecordedPalpation::update(const hal::RigSample& sample, PalpationSample& out) noexcept {
  newest_ = (newest_ + 1) % kMax;
  ring_[newest_] = {1e-9 * static_cast<double>(sample.time_ns), -sample.tip_position_mm.z,
                    sample.sensor_force_n.z};
  filled_ = std::min(filled_ + 1, window_);
  if (filled_ < window_) return false;
  const Moment& centre = ring_[(newest_ + kMax - window_ / 2) % kMax];
  const bool before = in_contact_;
  in_contact_ = std::abs(centre.force_n) > (before ? 0.5 : 1.0) * threshold_n_;
  if (in_contact_ && !before) ++contacts_;
  out.time_s = centre.time_s;
  out.displacement_mm = centre.depth_mm;
  out.normal_force_n = centre.force_n;
  out.rate_mm_per_s = slope_at_centre();
  out.in_contact = in_contact_;
  return true;
}

}  // namespace hapticd::identification
