#pragma once

#include <array>
#include <cstddef>
#include <variant>

#include "hal/samples.h"
#include "rt/friction/friction_model.h"

namespace hapticd::rt {

/// The friction's part of the Kalman filter in TrackedDirection: the friction coefficient φ as a vector along
/// the sliding, its variance and its covariance with the normal, isotropic in the tangent plane. There is one
/// class for each friction law; all have the functions of DahlFilter.

/// Motion of the tip across the normal.
struct FrictionSlide {
  hal::Vector3 slide_mm;  ///< by the encoders
  double path_mm = 0.0;   ///< part of it that pressing does not explain
  double share = 1.0;     ///< 0 … 1: how surely the encoders distinguish it from their rounding
};

/// φ by Dahl's law: one state. The slip distance only grows, so encoder counts back and forth would add up:
/// of slow motion the filter takes only the share that is certain.
class DahlFilter {
 public:
  /// Least relative standard deviation of the presliding distance: friction does not build up over the same
  /// distance everywhere, and the encoders miss a part of each turn.
  static constexpr double kMinPreslidingError = 0.5;

  explicit DahlFilter(const FrictionParameters& friction) noexcept : friction_(friction) {}

  /// Begins with no friction built up, known to `variance`, all of which the normal shares.
  void begin(double variance) noexcept;
  /// Predicts φ after a slide in the plane across `normal`. `level_error`: standard deviation of friction
  /// that slides; `blind_variance`: what may have changed unseen meanwhile.
  void predict(const FrictionSlide& slide, const hal::Vector3& normal, double level_error,
               double blind_variance) noexcept;
  /// Corrects by the `innovation` of the reaction's direction, of variance `total`; `normal` is the corrected
  /// one.
  void correct(const hal::Vector3& innovation, const hal::Vector3& normal, double normal_gain,
               double total) noexcept;
  void scale(double share) noexcept { coefficient_ = coefficient_ * share; }
  void turn_into(const hal::Vector3& normal) noexcept;

  const hal::Vector3& coefficient() const noexcept { return coefficient_; }
  double variance() const noexcept { return variance_; }
  double covariance() const noexcept { return covariance_; }

 private:
  FrictionParameters friction_;
  hal::Vector3 coefficient_;
  double variance_ = 0.0;
  double covariance_ = 0.0;
};

/// φ by Maxwell-slip elements: one state each, φ their sum. What sliding shows an element that slips it
/// does not show of one that still stretches, so each has its own variance and covariances; a correction goes
/// to the elements that are uncertain. Counts back and forth cancel, so slow motion counts in full. The size
/// is fixed; predict() and correct() take some 0.2 µs.
class MaxwellSlipFilter {
 public:
  /// Needs a `friction` that has elements.
  explicit MaxwellSlipFilter(const FrictionParameters& friction) noexcept;

  void begin(double variance) noexcept;
  void predict(const FrictionSlide& slide, const hal::Vector3& normal, double level_error,
               double blind_variance) noexcept;
  void correct(const hal::Vector3& innovation, const hal::Vector3& normal, double normal_gain,
               double total) noexcept;
  void scale(double share) noexcept;
  void turn_into(const hal::Vector3& normal) noexcept;

  const hal::Vector3& coefficient() const noexcept { return coefficient_; }
  double variance() const noexcept { return variance_; }
  double covariance() const noexcept { return covariance_; }

 private:
  static constexpr std::size_t kMax = MaxwellSlipParameters::kElements;
  void add_up() noexcept;

  std::size_t count_ = 0;  ///< elements that are there
  double kinetic_ = 0.0;
  std::array<double, kMax> reach_mm_{}, stiffness_per_mm_{}, share_{};  ///< share of μ_k
  std::array<hal::Vector3, kMax> stretch_mm_{};
  std::array<std::array<double, kMax>, kMax> covariances_{};
  std::array<double, kMax> with_normal_{};
  hal::Vector3 coefficient_;  ///< sums over the elements
  double variance_ = 0.0;
  double covariance_ = 0.0;
};

/// Filter for the law that the friction has.
class FrictionFilter {
 public:
  explicit FrictionFilter(const FrictionParameters& friction) noexcept
      : law_(friction.maxwell_slip ? Law(MaxwellSlipFilter(friction)) : Law(DahlFilter(friction))) {}

  void begin(double variance) noexcept {
    std::visit([&](auto& law) { law.begin(variance); }, law_);
  }
  void predict(const FrictionSlide& slide, const hal::Vector3& normal, double level_error,
               double blind_variance) noexcept {
    std::visit([&](auto& law) { law.predict(slide, normal, level_error, blind_variance); }, law_);
  }
  void correct(const hal::Vector3& innovation, const hal::Vector3& normal, double normal_gain,
               double total) noexcept {
    std::visit([&](auto& law) { law.correct(innovation, normal, normal_gain, total); }, law_);
  }
  void scale(double share) noexcept {
    std::visit([&](auto& law) { law.scale(share); }, law_);
  }
  void turn_into(const hal::Vector3& normal) noexcept {
    std::visit([&](auto& law) { law.turn_into(normal); }, law_);
  }
  const hal::Vector3& coefficient() const noexcept {
    return std::visit([](const auto& law) -> const hal::Vector3& { return law.coefficient(); }, law_);
  }
  double variance() const noexcept {
    return std::visit([](const auto& law) { return law.variance(); }, law_);
  }
  double covariance() const noexcept {
    return std::visit([](const auto& law) { return law.covariance(); }, law_);
  }

 private:
  using Law = std::variant<DahlFilter, MaxwellSlipFilter>;
  Law law_;
};

}  // namespace hapticd::rt
