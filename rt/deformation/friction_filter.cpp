#include "rt/deformation/friction_filter.h"

#include <algorithm>
#include <cmath>

#include "rt/friction/dahl.h"

namespace hapticd::rt {

namespace {
constexpr double kMinPathMm = 1e-12;
}  // namespace

void DahlFilter::begin(double variance) noexcept {
  coefficient_ = {};
  variance_ = covariance_ = variance;
}

void DahlFilter::predict(const FrictionSlide& slide, const hal::Vector3& normal, double level_error,
                         double blind_variance) noexcept {
  const double path_mm = slide.share * slide.path_mm;
  // Dahl's step keeps the share `kept` of what φ lacks of μ_k, and of its error the law's own derivative; the
  // rest is μ_k, known so well.
  const double kinetic = friction_.kinetic;
  coefficient_ = across(coefficient_, normal);
  double kept_of_error = 1.0;
  double by_presliding = 0.0;  // what the error of the presliding distance makes of this step
  if (path_mm > kMinPathMm) {
    const hal::Vector3 along = direction_or(slide.slide_mm, {});
    const double signed_to_go = kinetic > 0.0 ? 1.0 - dot(along, coefficient_) / kinetic : 1.0;
    const double to_go = std::min(std::abs(signed_to_go), 2.0);
    const DahlDecay decay = dahl_decay(to_go, path_mm, friction_.presliding_mm, friction_.exponent);
    const DahlSensitivity sensitivity = dahl_sensitivity(decay, friction_.exponent);
    const hal::Vector3 sliding = along * kinetic;
    const hal::Vector3 lacking = coefficient_ - sliding;
    kept_of_error = sensitivity.to_start;
    by_presliding = norm(lacking) * sensitivity.to_presliding *
                    std::max(kMinPreslidingError, friction_.presliding_relative_error);
    coefficient_ = sliding + lacking * decay.kept;
  }
  const double kept_of_variance = kept_of_error * kept_of_error;
  variance_ = kept_of_variance * variance_ + (1.0 - kept_of_variance) * level_error * level_error +
              by_presliding * by_presliding + blind_variance;
  variance_ = std::min(variance_, 4.0 * kinetic * kinetic);
  covariance_ *= kept_of_error;
}

void DahlFilter::correct(const hal::Vector3& innovation, const hal::Vector3& normal, double normal_gain,
                         double total) noexcept {
  const double to_friction = covariance_ - variance_;
  const double gain = to_friction / total;
  coefficient_ = across(coefficient_ + innovation * gain, normal);
  variance_ = std::max(0.0, variance_ - gain * to_friction);
  covariance_ -= normal_gain * to_friction;
}

void DahlFilter::turn_into(const hal::Vector3& normal) noexcept {
  coefficient_ = across(coefficient_, normal);
}

MaxwellSlipFilter::MaxwellSlipFilter(const FrictionParameters& friction) noexcept {
  if (!friction.maxwell_slip) return;
  const MaxwellSlipParameters& elements = *friction.maxwell_slip;
  kinetic_ = elements.kinetic();
  for (std::size_t i = 0; i < kMax; ++i) {
    const double level = elements.reach_mm[i] * elements.stiffness_per_mm[i];
    if (!(level > 0.0)) continue;
    reach_mm_[count_] = elements.reach_mm[i];
    stiffness_per_mm_[count_] = elements.stiffness_per_mm[i];
    share_[count_++] = level / kinetic_;
  }
}

void MaxwellSlipFilter::begin(double variance) noexcept {
  stretch_mm_ = {};
  covariances_ = {};
  with_normal_ = {};
  for (std::size_t i = 0; i < count_; ++i) covariances_[i][i] = with_normal_[i] = variance * share_[i];
  add_up();
}

void MaxwellSlipFilter::predict(const FrictionSlide& slide, const hal::Vector3& normal, double level_error,
                                double blind_variance) noexcept {
  const double path_mm = slide.path_mm;
  const bool slides = path_mm > kMinPathMm && std::isfinite(path_mm);
  const hal::Vector3 along_mm = slides ? direction_or(slide.slide_mm, {}) * path_mm : hal::Vector3{};
  std::array<double, kMax> kept{};
  for (std::size_t i = 0; i < count_; ++i) {
    const hal::Vector3 before_mm = across(stretch_mm_[i], normal);
    stretch_mm_[i] = slides ? maxwell_slip_step(before_mm, along_mm, reach_mm_[i]) : before_mm;
    // An element that slips forgets its error, one that stretches keeps it.
    const double beyond_mm = slides ? norm(before_mm + along_mm) - reach_mm_[i] : 0.0;
    kept[i] = beyond_mm > 0.0 ? std::max(0.0, 1.0 - beyond_mm / path_mm) : 1.0;
    for (std::size_t j = 0; j <= i; ++j) {
      covariances_[i][j] *= kept[i] * kept[j];
      covariances_[j][i] = covariances_[i][j];
    }
    with_normal_[i] *= kept[i];
    // While it stretches, the error of its stiffness grows to that of its level over its reach.
    const double fades = slides ? kept[i] * reach_mm_[i] / (reach_mm_[i] + path_mm) : 1.0;
    covariances_[i][i] += ((1.0 - fades * fades) * level_error * level_error + blind_variance) * share_[i];
  }
  add_up();
  const double limit = 4.0 * kinetic_ * kinetic_;
  if (!(variance_ > limit)) return;
  const double share = limit / variance_;
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t j = 0; j < count_; ++j) covariances_[i][j] *= share;
    with_normal_[i] *= std::sqrt(share);
  }
  add_up();
}

void MaxwellSlipFilter::correct(const hal::Vector3& innovation, const hal::Vector3& normal,
                                double normal_gain, double total) noexcept {
  std::array<double, kMax> to_element{};
  for (std::size_t i = 0; i < count_; ++i) {
    to_element[i] = with_normal_[i];
    for (std::size_t j = 0; j < count_; ++j) to_element[i] -= covariances_[i][j];
  }
  for (std::size_t i = 0; i < count_; ++i) {
    const hal::Vector3 more_mm = innovation * (to_element[i] / (total * stiffness_per_mm_[i]));
    stretch_mm_[i] = across(stretch_mm_[i] + more_mm, normal);
    for (std::size_t j = 0; j < count_; ++j) covariances_[i][j] -= to_element[i] * to_element[j] / total;
    covariances_[i][i] = std::max(0.0, covariances_[i][i]);
    with_normal_[i] -= normal_gain * to_element[i];
  }
  add_up();
}

void MaxwellSlipFilter::scale(double share) noexcept {
  for (std::size_t i = 0; i < count_; ++i) stretch_mm_[i] = stretch_mm_[i] * share;
  coefficient_ = coefficient_ * share;
}

void MaxwellSlipFilter::turn_into(const hal::Vector3& normal) noexcept {
  for (std::size_t i = 0; i < count_; ++i) stretch_mm_[i] = across(stretch_mm_[i], normal);
  coefficient_ = across(coefficient_, normal);
}

void MaxwellSlipFilter::add_up() noexcept {
  coefficient_ = {};
  variance_ = covariance_ = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    coefficient_ = coefficient_ + stretch_mm_[i] * stiffness_per_mm_[i];
    covariance_ += with_normal_[i];
    for (std::size_t j = 0; j < count_; ++j) variance_ += covariances_[i][j];
  }
  variance_ = std::max(0.0, variance_);
}

}  // namespace hapticd::rt
