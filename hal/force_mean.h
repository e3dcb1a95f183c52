#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::hal {

/// Mean of the sensor samples that arrived since the last tick (D§3.2.2: ten at 10 kHz). Halves neither
/// bandwidth nor promptness the way a recursive filter would: the delay is half the window, 0.45 ms for ten.
/// Non-finite samples are left out and counted as missing.
class ForceMean {
 public:
  void add(const Vector3& force_n, const Vector3& torque_n_mm) noexcept;
  /// Writes force, torque and count into the sample and starts over. With no sample since the last call the
  /// previous mean is kept and sample_status::kForceMissing is set.
  void take(RigSample& sample) noexcept;

 private:
  Vector3 force_sum_n_;
  Vector3 torque_sum_n_mm_;
  Vector3 last_force_n_;
  Vector3 last_torque_n_mm_;
  std::uint32_t count_ = 0;
};

}  // namespace hapticd::hal
