#include "server/identification/estimate/contact/surface_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::identification {

namespace {

constexpr double kBeyondScanMm = 2.0;
constexpr double kFinestMm = 0.01;  // of a touch, for a device whose resolution is not known

rt::ContactParameters parameters_of(double threshold_n) {
  rt::ContactParameters parameters;
  parameters.threshold_n = threshold_n;
  return parameters;
}

}  // namespace

SurfaceScan::SurfaceScan(double threshold_n, const hal::RigInfo& rig)
    : threshold_n_(threshold_n),
      min_error_mm_(std::max(kFinestMm, rig.device.position_resolution_mm / std::sqrt(12.0))),
      load_(rig.sensor.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0}),
      residual_(rig.sensor.tool_mass_g, rig.rate_hz),
      contact_(parameters_of(threshold_n), rig.rate_hz),
      onset_(rig.rate_hz) {}

bool SurfaceScan::add(const hal::RigSample& sample) {
  const hal::Vector3& tip_mm = sample.tip_position_mm;
  const hal::Vector3 force_n = load_.without_weight_n(sample) * -1.0;
  const hal::Vector3 r = residual_.update(force_n, tip_mm, sample.time_ns, contact_.in_contact());
  onset_.remember(tip_mm, residual_.prompt_force_n());
  contact_.update(rt::norm(r), -tip_mm.z, contact_depth_mm_);
  if (contact_.just_left_surface()) residual_.assume_free();
  const double now_s = 1e-9 * static_cast<double>(sample.time_ns);
  if (contact_.just_declared()) {
    place_mm_ = onset_.place_mm(0.5 * threshold_n_ + residual_.seen_jerk_n());
    contact_depth_mm_ = -place_mm_.z;
    began_s_ = now_s;
    hardest_n_ = 0.0;
    aside_mm_ = 0.0;
    touching_ = true;
  }
  if (contact_.in_contact()) {
    follow(force_n, tip_mm, now_s);
  } else if (touching_) {
    release(now_s);
  }
  return contact_.in_contact();
}

void SurfaceScan::follow(const hal::Vector3& force_n, const hal::Vector3& tip_mm, double now_s) {
  hardest_n_ = std::max(hardest_n_, rt::norm(force_n));
  aside_mm_ = std::max(aside_mm_, std::abs(tip_mm.x - place_mm_.x));
  if (hardest_n_ > kLightN) recovered_s_ = now_s + kRecoveryS;
}

void SurfaceScan::release(double now_s) {
  touching_ = false;
  if (hardest_n_ <= kLightN && aside_mm_ <= kInPlaceMm && now_s - began_s_ >= kMinTapS &&
      began_s_ >= recovered_s_) {
    touch(place_mm_);
  }
}

void SurfaceScan::restart() {
  residual_.reset();
  onset_.forget();
  contact_.reset();
  touching_ = false;
}

void SurfaceScan::touch(const hal::Vector3& place_mm) {
  ++touched_;
  const ProfilePoint point{place_mm.x, place_mm.z};
  touches_.insert(
      std::upper_bound(touches_.begin(), touches_.end(), point,
                       [](const ProfilePoint& a, const ProfilePoint& b) { return a.along_mm < b.along_mm; }),
      point);
  if (touches_.size() <= kMaxTouches) return;
  std::size_t crowded = 1;
  double min_mm = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < touches_.size(); ++i) {
    const double room_mm = touches_[i + 1].along_mm - touches_[i - 1].along_mm;
    if (room_mm < min_mm) {
      min_mm = room_mm;
      crowded = i;
    }
  }
  touches_.erase(touches_.begin() + static_cast<std::ptrdiff_t>(crowded));
}

hal::Result<SurfaceSpline> SurfaceScan::surface() const {
  return SurfaceSpline::fit(touches_, min_error_mm_);
}

std::optional<ScannedNormal> normal_at(const SurfaceSpline& surface, const hal::Vector3& tip_mm) {
  const double along_mm = surface.nearest_along_mm(tip_mm.x, tip_mm.z);
  if (!(along_mm > surface.from_mm() - kBeyondScanMm && along_mm < surface.to_mm() + kBeyondScanMm))
    return std::nullopt;
  const ProfileValue profile = surface.at(along_mm);
  const double length = std::hypot(1.0, profile.slope);
  ScannedNormal normal;
  normal.direction = {-profile.slope / length, 0.0, 1.0 / length};
  normal.error_rad = profile.slope_error / (length * length);
  return normal;
}

}  // namespace hapticd::identification
