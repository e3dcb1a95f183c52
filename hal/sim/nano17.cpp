#include "hal/sim/nano17.h"

#include <algorithm>
#include <cmath>

namespace hapticd::sim {

namespace {
constexpr double kResolutionN = 1.0 / 640.0;
constexpr double kNoiseN = 6.3e-3;  // per 10 kHz sample; 2 mN after the mean of ten
constexpr double kRangeAcrossN = 25.0;
constexpr double kRangeAlongN = 35.0;
constexpr double kLeverMm = 60.0;  // from the sensor's origin to the tip, along -z of the tool

double digitise(double force_n, double range_n, bool& saturated) noexcept {
  if (!(std::abs(force_n) < range_n)) saturated = true;
  return std::round(std::clamp(force_n, -range_n, range_n) / kResolutionN) * kResolutionN;
}
}  // namespace

Nano17::Nano17(double tool_mass_kg, std::uint64_t seed)
    : info_{"nano17_si_25", kRangeAlongN, kResolutionN, 10000.0, 1e3 * tool_mass_kg}, random_(seed) {}

void Nano17::measure(const hal::Vector3& force_n) noexcept {
  const hal::Vector3 reading{digitise(force_n.x + kNoiseN * random_.normal(), kRangeAcrossN, saturated_),
                             digitise(force_n.y + kNoiseN * random_.normal(), kRangeAcrossN, saturated_),
                             digitise(force_n.z + kNoiseN * random_.normal(), kRangeAlongN, saturated_)};
  const hal::Vector3 unbiased = reading - bias_n_;
  // r × F with r = (0, 0, -lever).
  mean_.add(unbiased, {kLeverMm * unbiased.y, -kLeverMm * unbiased.x, 0.0});
}

void Nano17::read(hal::RigSample& sample) noexcept {
  mean_.take(sample);
  last_mean_n_ = sample.sensor_force_n;
  sample.force_age_ns = 0;
  if (saturated_) sample.status |= hal::sample_status::kForceSaturated;
  saturated_ = false;
}

}  // namespace hapticd::sim
