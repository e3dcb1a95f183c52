#pragma once

#include <optional>

#include "rt/friction/dahl.h"
#include "rt/friction/friction_model.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/vector.h"

namespace hapticd::study {

/// The direction of the reaction as it is, friction and all, through a Butterworth filter or none: what there
/// is without any friction model. A candidate.
class ReactionDirection {
 public:
  ReactionDirection(std::optional<double> cutoff_hz, double rate_hz) noexcept {
    if (cutoff_hz) filter_.emplace(*cutoff_hz, rate_hz);
  }
  void begin(const hal::Vector3& reaction_n) noexcept {
    normal_ = rt::direction_or(reaction_n, normal_);
    if (filter_) filter_->seed(normal_);
  }
  void update(const hal::Vector3& reaction_n, const hal::Vector3&, const hal::Vector3&) noexcept {
    const hal::Vector3 raw = rt::direction_or(reaction_n, normal_);
    normal_ = filter_ ? rt::direction_or(filter_->update(raw), normal_) : raw;
  }
  const hal::Vector3& normal() const noexcept { return normal_; }

 private:
  std::optional<rt::ButterworthLowPass3> filter_;
  hal::Vector3 normal_{0.0, 0.0, 1.0};
};

/// rt::PublishedDirection, (4.10)-(4.20), with the cut-off of its last step left open: none = no filter at
/// all. At 70 Hz the two are the same.
class PublishedDirectionAt {
 public:
  PublishedDirectionAt(std::optional<double> cutoff_hz, rt::FrictionLaw law,
                       const rt::FrictionParameters& friction, double rate_hz) noexcept
      : law_(law), friction_(friction) {
    if (cutoff_hz) filter_.emplace(*cutoff_hz, rate_hz);
  }
  void begin(const hal::Vector3& reaction_n) noexcept {
    normal_ = rt::direction_or(reaction_n, normal_);
    if (filter_) filter_->seed(normal_);
    tangent_ = {};
    built_up_ = 0.0;
  }
  void update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
              const hal::Vector3& velocity_mm_per_s) noexcept {
    const hal::Vector3 slide_mm = rt::across(step_mm, normal_);  // (4.17), (4.18)
    const double path_mm = rt::norm(slide_mm);
    if (path_mm > 1e-9) {
      const hal::Vector3 tangent = slide_mm * (1.0 / path_mm);  // (4.19)
      built_up_ = rt::dahl_step(built_up_ * dot(tangent_, tangent), path_mm, friction_.presliding_mm,
                                friction_.exponent);
      tangent_ = tangent;
    }
    const double share = law_ == rt::FrictionLaw::kDahl ? built_up_ : 1.0;
    const double friction_n = friction_.kinetic * dot(reaction_n, normal_) * share +
                              friction_.viscous_n_s_per_mm * dot(velocity_mm_per_s, tangent_);
    const hal::Vector3 raw = rt::direction_or(reaction_n + tangent_ * friction_n, normal_);  // (4.10), (4.16)
    normal_ = filter_ ? rt::direction_or(filter_->update(raw), normal_) : raw;
  }
  const hal::Vector3& normal() const noexcept { return normal_; }

 private:
  rt::FrictionLaw law_;
  rt::FrictionParameters friction_;
  std::optional<rt::ButterworthLowPass3> filter_;
  hal::Vector3 normal_{0.0, 0.0, 1.0};
  hal::Vector3 tangent_;
  double built_up_ = 0.0;
};

}  // namespace hapticd::study
