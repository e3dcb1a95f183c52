#include "hal/force_mean.h"

#include <cmath>

namespace hapticd::hal {

namespace {
bool finite(const Vector3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
}  // namespace

void ForceMean::add(const Vector3& force_n, const Vector3& torque_n_mm) noexcept {
  if (!finite(force_n) || !finite(torque_n_mm)) return;
  force_sum_n_ = force_sum_n_ + force_n;
  torque_sum_n_mm_ = torque_sum_n_mm_ + torque_n_mm;
  ++count_;
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
