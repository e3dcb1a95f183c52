#include "rt/modulation/friction_modulation.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

constexpr double kMinNormalN = 0.05;
constexpr double kMinSlideMm = 1e-6;

struct TargetRange {
  const char* key;
  double value, low, high;
};

}  // namespace

std::optional<hal::Error> check(const FrictionTarget& target, const std::string& prefix,
                                const std::string& where) {
  if (target.scale.has_value() == target.coefficient.has_value()) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "a friction target is a scale or a coefficient",
                          where, target.scale ? "both" : "neither",
                          prefix + "scale or " + prefix + "coefficient", "give one of them");
  }
  const TargetRange r = target.scale
                            ? TargetRange{"scale", *target.scale, 1.0 - FrictionModulation::kMaxReduction,
                                          FrictionModulation::kMaxScale}
                            : TargetRange{"coefficient", *target.coefficient, 0.02, 3.0};
  constexpr double kRounding = 1e-9;
  if (r.value >= r.low - kRounding && r.value <= r.high) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kOutOfRange, prefix + r.key + " is out of range", where,
                        std::to_string(r.value), std::to_string(r.low) + " … " + std::to_string(r.high), "");
}

void FrictionModulation::follow_axis(const hal::Vector3& slide_mm, const hal::Vector3& normal) noexcept {
  const double path_mm = norm(slide_mm);
  if (!(path_mm > kMinSlideMm)) {
    axis_ = direction_or(across(axis_, normal), {});
    return;
  }
  hal::Vector3 along = slide_mm * (1.0 / path_mm);
  if (dot(along, axis_) < 0.0) along = along * -1.0;
  const double share = norm(axis_) > 0.0 ? path_mm / (path_mm + kAxisMemoryMm) : 1.0;
  axis_ = direction_or(across(axis_ + (along - axis_) * share, normal), axis_);
}

void FrictionModulation::follow_fade(double speed_mm_per_s, double s) noexcept {
  // The sign of a slow motion means nothing: encoders count back and forth.
  const bool slides = std::abs(speed_mm_per_s) > kFadeSpeedMmPerS;
  const bool turned = slides && speed_mm_per_s * last_along_ < 0.0;
  if (slides) last_along_ = std::copysign(1.0, speed_mm_per_s);
  since_turn_s_ = turned ? 0.0 : since_turn_s_ + s;
  may_rise_ = fade_ == 0.0 || (may_rise_ && !turned);
  const bool wanted = slides && may_rise_ && since_turn_s_ >= kTurnS;
  fade_ = std::clamp(fade_ + (wanted ? s / kRiseS : -s / kFadeS), 0.0, 1.0);
}

double FrictionModulation::wanted_scale(const Input& now, double along_n) noexcept {
  if (target_.scale) return *target_.scale;
  constexpr double kMaxLevelError = 1.5;  // of what was identified
  const double level_n = kinetic_ * std::max(now.normal_n, kMinNormalN);
  const bool is_steady =
      std::abs(dot(now.velocity_mm_per_s, axis_)) > kFadeSpeedMmPerS && since_turn_s_ >= kFadeS;
  if (is_steady) {
    const double share = now.interval.s / (now.interval.s + kLevelS);
    level_ +=
        (std::clamp(std::abs(along_n) / level_n, 1.0 / kMaxLevelError, kMaxLevelError) - level_) * share;
  }
  return *target_.coefficient * std::max(now.hand_normal_n, 0.0) / (level_ * level_n);
}

hal::Vector3 FrictionModulation::update(const Input& now) noexcept {
  if (!finite(now.friction_n + now.normal + now.step_mm + now.velocity_mm_per_s) ||
      !std::isfinite(now.normal_n + now.hand_normal_n)) {
    rest();
    return {};
  }
  follow_axis(across(now.step_mm, now.normal), now.normal);
  follow_fade(dot(now.velocity_mm_per_s, axis_), now.interval.s);
  const double level_n = kinetic_ * std::max(now.normal_n, 0.0);
  const double measured_n = dot(now.friction_n, axis_);
  const double wanted = wanted_scale(now, measured_n);
  scale_ = std::clamp(wanted, 1.0 - kMaxReduction, kMaxScale);
  if (level_n > 0.0) scale_ = std::min(scale_, 1.0 + kMaxAddedN / level_n);
  if (scale_ < 1.0) scale_ = 1.0 - (1.0 - scale_) * fade_;
  is_bounded_ = scale_ != wanted;
  const double along_n = std::clamp(measured_n, -kMaxLevel * level_n, kMaxLevel * level_n);
  force_n_ = axis_ * ((scale_ - 1.0) * along_n);
  return force_n_;
}

void FrictionModulation::rest() noexcept {
  axis_ = force_n_ = {};
  fade_ = last_along_ = since_turn_s_ = 0.0;
  may_rise_ = true;
  level_ = 1.0;
  scale_ = 1.0;
  is_bounded_ = false;
}

FrictionRange feasible_friction(double real_n, double hand_normal_n, double spare_n) noexcept {
  if (!(hand_normal_n > 0.0)) return {};
  const double real = std::abs(real_n) / hand_normal_n;
  return {real * (1.0 - FrictionModulation::kMaxReduction),
          std::min(real * FrictionModulation::kMaxScale,
                   real + std::clamp(spare_n, 0.0, FrictionModulation::kMaxAddedN) / hand_normal_n)};
}

}  // namespace hapticd::rt
