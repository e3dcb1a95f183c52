#include "hal/sim/nano17.h"

#include <algorithm>
#include <cmath>

namespace hapticd::sim {

namespace {
constexpr double kResolutionN = 1.0 / 640.0;
constexpr double kNoiseN = 6.3e-3;  // per 10 kHz sample; 2 mN after the mean of ten
constexpr double kRangeAcrossN = 25.0;
constexpr double kRangeAlongN = 35.0;

// Torque, SI-25-0.25: range of the data sheet; resolution and noise in the proportion of its 1/32 N·mm to
// 1/160 N (assumed for the noise).
constexpr double kTorqueRangeNMm = 250.0;
constexpr double kTorqueResolutionNMm = 1.0 / 128.0;
constexpr double kTorqueNoiseNMm = 5.0 * kNoiseN;

double digitise(double load, double range, double resolution, bool& saturated) noexcept {
  if (!(std::abs(load) < range)) saturated = true;
  return std::round(std::clamp(load, -range, range) / resolution) * resolution;
}
}  // namespace

Nano17::Nano17(double tool_mass_kg, std::uint64_t seed)
    : info_{"nano17_si_25", kRangeAlongN, kResolutionN, 10000.0, 1e3 * tool_mass_kg},
      random_(seed),
      torque_random_(seed ^ 0x746f72717565ULL) {}

void Nano17::measure(const hal::Vector3& force_n) noexcept {
  const hal::Vector3 unbiased = reading_n(force_n);
  // r × F with r = (0, 0, -lever).
  mean_.add(unbiased, {kLeverMm * unbiased.y, -kLeverMm * unbiased.x, 0.0});
}

hal::Vector3 Nano17::reading_n(const hal::Vector3& force_n) noexcept {
  const auto channel = [&](double load_n, double range_n) {
    return digitise(load_n + kNoiseN * random_.normal(), range_n, kResolutionN, saturated_);
  };
  const hal::Vector3 reading{channel(force_n.x, kRangeAcrossN), channel(force_n.y, kRangeAcrossN),
                             channel(force_n.z, kRangeAlongN)};
  return reading - bias_n_;
}

void Nano17::measure(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept {
  const auto channel = [&](double load_n_mm) {
    return digitise(load_n_mm + kTorqueNoiseNMm * torque_random_.normal(), kTorqueRangeNMm,
                    kTorqueResolutionNMm, saturated_);
  };
  const hal::Vector3 torque{channel(torque_n_mm.x), channel(torque_n_mm.y), channel(torque_n_mm.z)};
  mean_.add(reading_n(force_n), torque - torque_bias_n_mm_);
}

void Nano17::bias() noexcept {
  bias_n_ = bias_n_ + last_mean_n_;
  torque_bias_n_mm_ = torque_bias_n_mm_ + last_mean_torque_n_mm_;
}

void Nano17::read(hal::RigSample& sample) noexcept {
  mean_.take(sample);
  last_mean_n_ = sample.sensor_force_n;
  last_mean_torque_n_mm_ = sample.sensor_torque_n_mm;
  sample.force_age_ns = 0;
  if (saturated_) sample.status |= hal::sample_status::kForceSaturated;
  saturated_ = false;
}

}  // namespace hapticd::sim
