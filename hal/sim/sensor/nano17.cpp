#include "hal/sim/sensor/nano17.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

constexpr std::size_t kMaxWaiting = 8192;  // 0.8 s; the oldest are lost then

double digitise(double load, double range, double resolution, bool& saturated) noexcept {
  if (!(std::abs(load) < range)) saturated = true;
  return std::round(std::clamp(load, -range, range) / resolution) * resolution;
}
}  // namespace

Nano17::Nano17(double tool_mass_kg, std::uint64_t seed, const Conditions& conditions, double step_s,
               bool samples_wait)
    : info_{"nano17_si_25", kRangeAlongN, kResolutionN, 10000.0, 1e3 * tool_mass_kg},
      noise_n_(std::hypot(kNoiseN, conditions.sensor_noise_n * std::sqrt(1e-3 / step_s))),
      zero_(conditions, seed, step_s),
      step_ns_(std::llround(1e9 * step_s)),
      measures_(conditions.sensor_frozen_at_s > 0.0 ? std::llround(conditions.sensor_frozen_at_s / step_s)
                                                    : std::numeric_limits<std::int64_t>::max()),
      delay_ns_(std::llround(1e6 * conditions.sensor_delay_ms)),
      delay_reported_(conditions.delays_reported > 0.5),
      waiting_(samples_wait || delay_ns_ > 0 ? kMaxWaiting : 0),
      random_(seed),
      torque_random_(seed ^ 0x746f72717565ULL) {}

void Nano17::measure(const hal::Vector3& force_n) noexcept {
  const hal::Vector3 unbiased = reading_n(force_n);
  // r × F with r = (0, 0, -lever).
  send({unbiased, {kLeverMm * unbiased.y, -kLeverMm * unbiased.x, 0.0}});
}

hal::Vector3 Nano17::reading_n(const hal::Vector3& force_n) noexcept {
  const auto channel = [&](double load_n, double range_n) {
    return digitise(load_n + noise_n_ * random_.normal(), range_n, kResolutionN, saturated_);
  };
  hal::Vector3 load_n = force_n;
  if (zero_.active()) {
    zero_.advance();
    load_n = zero_.crossed(force_n) + zero_.offset_n();
  }
  const hal::Vector3 reading{channel(load_n.x, kRangeAcrossN), channel(load_n.y, kRangeAcrossN),
                             channel(load_n.z, kRangeAlongN)};
  return reading - bias_n_;
}

void Nano17::measure(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept {
  const auto channel = [&](double load_n_mm) {
    return digitise(load_n_mm + kTorqueNoiseNMm * torque_random_.normal(), kTorqueRangeNMm,
                    kTorqueResolutionNMm, saturated_);
  };
  const hal::Vector3 torque{channel(torque_n_mm.x), channel(torque_n_mm.y), channel(torque_n_mm.z)};
  send({reading_n(force_n), torque - torque_bias_n_mm_});
}

void Nano17::send(const Reading& reading) noexcept {
  if (made_ < measures_) last_ = reading;
  if (waiting_.empty()) {
    mean_.add(last_.force_n, last_.torque_n_mm);
  } else {
    waiting_[static_cast<std::size_t>(made_) % waiting_.size()] = last_;
  }
  ++made_;
}

void Nano17::deliver(const Arrival& arrival) noexcept {
  const std::int64_t steps_behind =
      (delay_ns_ + arrival.late_ns - arrival.beyond_ns + step_ns_ - 1) / step_ns_;
  const std::int64_t here = made_ - std::max<std::int64_t>(0, steps_behind);
  if (!waiting_.empty()) {
    arrived_ = std::max(arrived_, made_ - static_cast<std::int64_t>(waiting_.size()));
    for (; arrived_ < here && !arrival.lost; ++arrived_) {
      const Reading& reading = waiting_[static_cast<std::size_t>(arrived_) % waiting_.size()];
      mean_.add(reading.force_n, reading.torque_n_mm);
    }
  }
  arrived_ = std::max(arrived_, here);
}

void Nano17::bias(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept {
  bias_n_ = bias_n_ + force_n;
  torque_bias_n_mm_ = torque_bias_n_mm_ + torque_n_mm;
}

void Nano17::read(hal::RigSample& sample, const Arrival& arrival) noexcept {
  deliver(arrival);
  mean_.take(sample);
  const std::int64_t now_ns = made_ * step_ns_ + arrival.beyond_ns;
  if (sample.force_count > 0) {
    // A sample without a time stamp counts as new when it arrives.
    newest_ns_ = delay_reported_ || waiting_.empty() ? arrived_ * step_ns_ : now_ns;
    mean_ns_ = newest_ns_ - (sample.force_count - 1) * step_ns_ / 2;
  }
  sample.force_age_ns = now_ns - newest_ns_;
  sample.force_mean_age_ns = now_ns - mean_ns_;
  if (saturated_) sample.status |= hal::sample_status::kForceSaturated;
  saturated_ = false;
}

}  // namespace hapticd::sim
