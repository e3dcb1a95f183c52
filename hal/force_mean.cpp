#include "hal/force_mean.h"

#include <algorithm>
#include <limits>

namespace hapticd::hal {

void ForceMean::add(const Vector3& force_n, const Vector3& torque_n_mm) noexcept {
  if (!finite(force_n) || !finite(torque_n_mm)) return;
  force_sum_n_ = force_sum_n_ + force_n;
  torque_sum_n_mm_ = torque_sum_n_mm_ + torque_n_mm;
  ++count_;
}

void ForceMean::add(const Vector3& force_n, const Vector3& torque_n_mm, std::int64_t time_ns) noexcept {
  const std::uint32_t before = count_;
  add(force_n, torque_n_mm);
  if (count_ == before) return;
  if (before == 0) {
    first_time_ns_ = time_ns;
    sum_since_first_ns_ = 0;
  }
  sum_since_first_ns_ += time_ns - first_time_ns_;
}

void ForceMean::take(RigSample& sample, std::int64_t now_ns) noexcept {
  if (count_ > 0) {
    mean_time_ns_ = first_time_ns_ + sum_since_first_ns_ / static_cast<std::int64_t>(count_);
    has_mean_time_ = true;
  }
  take(sample);
  sample.force_mean_age_ns = has_mean_time_ ? std::max<std::int64_t>(0, now_ns - mean_time_ns_)
                                            : std::numeric_limits<std::int64_t>::max();
}

void ForceMean::take(RigSample& sample) noexcept {
  if (count_ == 0) {
    sample.status |= sample_status::kForceMissing;
  } else {
    last_force_n_ = force_sum_n_ * (1.0 / count_);
    last_torque_n_mm_ = torque_sum_n_mm_ * (1.0 / count_);
  }
  sample.sensor_force_n = last_force_n_;
  sample.sensor_torque_n_mm = last_torque_n_mm_;
  sample.force_count = count_;
  force_sum_n_ = {};
  torque_sum_n_mm_ = {};
  count_ = 0;
}

}  // namespace hapticd::hal
