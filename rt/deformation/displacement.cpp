#include "rt/deformation/displacement.h"

#include <algorithm>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {
constexpr double kOnsetDeviationMm = 0.03;
constexpr double kUnrecoveredError = 0.2;  // of what the law says has not recovered yet
constexpr double kUnseenDeviationMm = 0.15;
}  // namespace

void Displacement::start(const hal::Vector3& began_mm, double deviation_mm,
                         double min_deviation_mm) noexcept {
  if (auto* fused = std::get_if<FusedDisplacement>(&path_)) {
    fused->begin(displacement_mm_, deviation_mm, min_deviation_mm);
  } else if (auto* inverse = std::get_if<InverseDisplacement>(&path_)) {
    inverse->filter.seed(0.0);
  } else {
    std::get_if<RecursiveDisplacement>(&path_)->contacted_mm = began_mm;
  }
}

void Displacement::begin(const hal::Vector3& began_mm, const hal::Vector3& tip_mm, const hal::Vector3& normal,
                         double below_threshold_n) noexcept {
  // An object that has not recovered yet is met below its undeformed surface; the law remembers how far.
  const double unrecovered_mm = by_law_.displacement_mm;
  displacement_mm_ = unrecovered_mm + std::max(0.0, dot(began_mm - tip_mm, normal));
  start(began_mm,
        kOnsetDeviationMm + displacement_below_threshold_mm(below_threshold_n) +
            kUnrecoveredError * unrecovered_mm,
        0.0);
}

void Displacement::begin_unseen(const hal::Vector3& tip_mm, double normal_n) noexcept {
  if (std::holds_alternative<HuntCrossleyParameters>(law_)) by_law_ = law_estimate(normal_n, 0.0, 1.0);
  displacement_mm_ = by_law_.displacement_mm;
  start(tip_mm, kUnseenDeviationMm + kUnrecoveredError * displacement_mm_, kUnseenDeviationMm);
}

double Displacement::displacement_below_threshold_mm(double below_threshold_n) const noexcept {
  if (const auto* creep = std::get_if<CreepLaw>(&law_))
    return creep->curve(below_threshold_n).displacement_mm;
  if (const auto* law = std::get_if<HuntCrossleyParameters>(&law_)) {
    return hunt_crossley_displacement(*law, below_threshold_n, 0.0).displacement_mm;
  }
  return 0.0;
}

LawEstimate Displacement::law_estimate(double normal_n, double rate_mm_per_s, double periods) noexcept {
  if (auto* creep = std::get_if<CreepLaw>(&law_)) return creep->update(normal_n, periods);
  if (const auto* law = std::get_if<HuntCrossleyParameters>(&law_)) {
    return hunt_crossley_displacement(*law, normal_n, rate_mm_per_s);
  }
  return {};
}

void Displacement::update(const hal::Vector3& tip_mm, double inward_mm, const hal::Vector3& slide_mm,
                          const hal::Vector3& normal, double normal_n, double rate_mm_per_s,
                          const TickInterval& interval) noexcept {
  const double periods = interval.elapsed_periods;
  if (auto* fused = std::get_if<FusedDisplacement>(&path_)) {
    by_law_ = law_estimate(normal_n, rate_mm_per_s, periods);
    fused->update(inward_mm, norm(slide_mm), by_law_, interval.periods);
    displacement_mm_ = fused->displacement_mm();
  } else if (auto* inverse = std::get_if<InverseDisplacement>(&path_)) {
    by_law_ = law_estimate(inverse->filter.update(normal_n, interval.periods), rate_mm_per_s, periods);
    displacement_mm_ = by_law_.displacement_mm;
  } else {
    hal::Vector3& contacted_mm = std::get_if<RecursiveDisplacement>(&path_)->contacted_mm;
    contacted_mm = contacted_mm + slide_mm;  // (4.21)
    displacement_mm_ = dot(contacted_mm - tip_mm, normal);
  }
}

void Displacement::rest(double path_mm, double unexplained_n, const TickInterval& interval) noexcept {
  displacement_mm_ += path_mm;
  // Only a law with memory has something to say about an object that is not touched.
  by_law_ = std::holds_alternative<CreepLaw>(law_)
                ? law_estimate(unexplained_n, 0.0, interval.elapsed_periods)
                : LawEstimate{};
}

void Displacement::reset() noexcept {
  if (auto* creep = std::get_if<CreepLaw>(&law_)) creep->reset();
  by_law_ = {};
  displacement_mm_ = 0.0;
}

double Displacement::deviation_mm() const noexcept {
  const auto* fused = std::get_if<FusedDisplacement>(&path_);
  return fused != nullptr ? fused->deviation_mm() : 0.0;
}

}  // namespace hapticd::rt
