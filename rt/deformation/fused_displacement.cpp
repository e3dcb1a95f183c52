#include "rt/deformation/fused_displacement.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

FusedDisplacement::FusedDisplacement(double law_error, double force_noise_n, double rate_hz) noexcept
    : law_error_(law_error),
      law_error_ticks_(kLawErrorTimeS * rate_hz),
      force_variance_n2_(force_noise_n * force_noise_n) {}

void FusedDisplacement::begin(double displacement_mm, double deviation_mm, double min_deviation_mm) noexcept {
  displacement_mm_ = displacement_mm;
  variance_mm2_ = deviation_mm * deviation_mm;
  min_variance_mm2_ = min_deviation_mm * min_deviation_mm;
  own_variance_mm2_ = variance_mm2_;
  law_share_ = 0.0;
  deepest_mm_ = displacement_mm;
}

void FusedDisplacement::update(double path_mm, double slide_mm, const LawEstimate& law,
                               double periods) noexcept {
  displacement_mm_ += path_mm;
  const double slid_mm2 = kDirectionErrorRad * kDirectionErrorRad * kDirectionPathMm * slide_mm;
  variance_mm2_ += slid_mm2;
  const double model_mm = law_error_ * law.displacement_mm + kLawOffsetMm;
  const double noise_mm2 = law.mm_per_n * law.mm_per_n * force_variance_n2_;
  const double law_variance_mm2 =
      noise_mm2 + law_error_ticks_ / std::max(periods, kMinPeriods) * model_mm * model_mm;
  const double gain = variance_mm2_ / (variance_mm2_ + law_variance_mm2);
  displacement_mm_ += gain * (law.displacement_mm - displacement_mm_);
  // While the law sees a force there is no negative displacement, whatever the path added up to.
  if (law.displacement_mm > 0.0) displacement_mm_ = std::max(0.0, displacement_mm_);
  variance_mm2_ = std::max(min_variance_mm2_, variance_mm2_ * (1.0 - gain));
  deepest_mm_ = std::max(deepest_mm_, displacement_mm_);
  const double kept = 1.0 - gain;
  law_share_ = kept * law_share_ + gain;
  own_variance_mm2_ = kept * kept * (own_variance_mm2_ + slid_mm2) + gain * gain * noise_mm2;
}

double FusedDisplacement::deviation_mm() const noexcept {
  const double by_law_mm = law_share_ * (kBiasShare * law_error_ * deepest_mm_ + kBiasMm);
  return std::sqrt(own_variance_mm2_ + by_law_mm * by_law_mm);
}

}  // namespace hapticd::rt
