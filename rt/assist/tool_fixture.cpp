#include "rt/assist/tool_fixture.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

namespace {

struct FixtureRange {
  const char* name;
  double FixtureParameters::*value;
  double least;
  double most;
};

constexpr FixtureRange kRanges[] = {
    {"stiffness_n_per_mm", &FixtureParameters::stiffness_n_per_mm, 0.05, 1.0},
    {"damping_n_s_per_mm", &FixtureParameters::damping_n_s_per_mm, 0.001, 0.005},
    {"max_force_n", &FixtureParameters::max_force_n, 0.1, 4.0},
    {"ceiling_mm", &FixtureParameters::ceiling_mm, 0.0, 20.0},
    {"corridor_mm", &FixtureParameters::corridor_mm, 0.0, 50.0},
    {"let_go_mm", &FixtureParameters::let_go_mm, 2.0, 50.0},
};

}  // namespace

std::optional<hal::Error> check(const FixtureParameters& parameters, const std::string& where) {
  for (const FixtureRange& range : kRanges) {
    const double value = parameters.*range.value;
    if (value >= range.least && value <= range.most) continue;
    return hal::Error::of(
        hal::ErrorCode::kOutOfRange, std::string("fixture.") + range.name + " is out of range", where,
        std::to_string(value), std::to_string(range.least) + " … " + std::to_string(range.most),
        "give a value within the range");
  }
  return std::nullopt;
}

double ToolFixture::push_n(double depth_mm, double speed_mm_per_s) const noexcept {
  if (depth_mm <= 0.0) return 0.0;
  const double spring_n = parameters_.stiffness_n_per_mm * depth_mm;
  if (speed_mm_per_s < 0.0) return spring_n * std::max(0.0, 1.0 + speed_mm_per_s / kReturnMmPerS);
  return spring_n +
         parameters_.damping_n_s_per_mm * speed_mm_per_s * std::min(1.0, depth_mm / kFullDampingMm);
}

hal::Vector3 ToolFixture::walls_n(const Situation& now) noexcept {
  const hal::Vector3 from_anchor_mm = now.tip_mm - anchor_mm_;
  const double below_mm = dot(from_anchor_mm, axis_);
  const hal::Vector3 aside_mm = from_anchor_mm - axis_ * below_mm;
  const double radius_mm = std::sqrt(dot(aside_mm, aside_mm));
  const hal::Vector3 outward = radius_mm > 0.0 ? aside_mm * (1.0 / radius_mm) : hal::Vector3{};
  const double above_mm = -below_mm - parameters_.ceiling_mm;
  const double beyond_mm = radius_mm - parameters_.corridor_mm;
  if (std::max(above_mm, beyond_mm) > parameters_.let_go_mm) {
    is_anchored_ = false;
    return last_n_;
  }
  const hal::Vector3 force_n = axis_ * push_n(above_mm, -dot(now.velocity_mm_per_s, axis_)) -
                               outward * push_n(beyond_mm, dot(now.velocity_mm_per_s, outward));
  const double size_n = std::sqrt(dot(force_n, force_n));
  return size_n > parameters_.max_force_n ? force_n * (parameters_.max_force_n / size_n) : force_n;
}

hal::Vector3 ToolFixture::update(const Situation& now) noexcept {
  if (!now.is_force_allowed || (now.is_withdrawn && is_first_contact_)) is_anchored_ = false;
  if (!now.is_force_allowed) share_ = 0.0;
  if (!is_anchored_ && now.in_contact && now.is_force_allowed) {
    is_anchored_ = true;
    is_first_contact_ = true;
    anchor_mm_ = now.tip_mm - axis_ * now.displacement_mm;
  }
  is_first_contact_ = is_first_contact_ && now.in_contact;
  if (is_anchored_) last_n_ = walls_n(now);
  const double step = now.interval_s / kFadeS;
  share_ = is_anchored_ && !now.is_guided ? std::min(1.0, share_ + step) : std::max(0.0, share_ - step);
  return last_n_ * share_;
}

}  // namespace hapticd::rt
