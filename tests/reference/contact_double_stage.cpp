#include "tests/reference/contact_double_stage.h"

#include <algorithm>
#include <cmath>

namespace hapticd::identification {

namespace {
// Start when nothing is known: a newton's worth of data outweighs it at once.
constexpr double kStiffnessVariance = 1e4;
constexpr double kDampingVariance = 1.0;
constexpr double kExponentVariance = 1.0;
constexpr std::size_t kFirstStageAlone = 50;
}  // namespace

DoubleStageEstimator::DoubleStageEstimator(const Options& options) noexcept
    : options_(options), p00_(kStiffnessVariance), p11_(kDampingVariance), q_(kExponentVariance) {}

double DoubleStageEstimator::covariance_share() const noexcept {
  return std::max({p00_ / kStiffnessVariance, p11_ / kDampingVariance, q_ / kExponentVariance});
}

void DoubleStageEstimator::change_unit(double unit_mm) noexcept {
  if (unit_mm_ > 0.0) {
    const double scale = std::pow(unit_mm / unit_mm_, exponent_);
    stiffness_ *= scale;
    damping_ *= scale;
  }
  unit_mm_ = unit_mm;
}

void DoubleStageEstimator::take(double x, double v, double f) noexcept {
  if (!std::isfinite(x) || !std::isfinite(v) || !std::isfinite(f)) return;
  deepest_mm_ = std::max(deepest_mm_, x);
  if (x < options_.min_share * deepest_mm_) return;
  constexpr double kUnitShare = 0.7;
  if (kUnitShare * deepest_mm_ > 1.1 * unit_mm_) change_unit(kUnitShare * deepest_mm_);
  ++samples_;
  const double lambda = options_.forgetting;
  const double log_x = std::log(x / unit_mm_);
  const double power = std::exp(exponent_ * log_x);

  // First stage: φ = x^m [1, ẋ].
  const double a0 = p00_ * power + p01_ * power * v;
  const double a1 = p01_ * power + p11_ * power * v;
  const double gain = 1.0 / (lambda + power * a0 + power * v * a1);
  const double error = f - power * (stiffness_ + damping_ * v);
  stiffness_ += a0 * gain * error;
  damping_ += a1 * gain * error;
  p00_ = std::min((p00_ - gain * a0 * a0) / lambda, kStiffnessVariance);
  p11_ = std::min((p11_ - gain * a1 * a1) / lambda, kDampingVariance);
  p01_ = (p01_ - gain * a0 * a1) / lambda;
  // Rounding must not cost the definiteness.
  const double most = 0.9999999 * std::sqrt(std::max(0.0, p00_) * std::max(0.0, p11_));
  p01_ = std::clamp(p01_, -most, most);

  // Second stage.
  const double coefficient = stiffness_ + damping_ * v;
  if (samples_ < kFirstStageAlone || !(coefficient > 0.2 * stiffness_) || !(stiffness_ > 0.0)) return;
  const double y = std::log(f / coefficient);
  const double weight = f * f;
  const double b = q_ * log_x;
  const double share = weight / (lambda + weight * log_x * b);
  exponent_ = std::clamp(exponent_ + b * share * (y - exponent_ * log_x), 1.0, 3.0);
  q_ = std::min((q_ - share * b * b) / lambda, kExponentVariance);
}

std::optional<HuntCrossleyEstimate> DoubleStageEstimator::estimate() const {
  if (samples_ < options_.fewest_samples || !(stiffness_ > 0.0) || !std::isfinite(stiffness_)) {
    return std::nullopt;
  }
  const double scale = std::pow(unit_mm_, -exponent_);
  return HuntCrossleyEstimate{
      {scale * stiffness_, scale * std::max(0.0, damping_), exponent_}, 0.0, samples_};
}

}  // namespace hapticd::identification
