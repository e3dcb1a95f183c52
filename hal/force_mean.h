#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::hal {

/// Mean of the sensor samples that arrived since the last tick (D§3.2.2: ten at 10 kHz). Costs less
/// bandwidth and delay than a recursive filter: the delay is half the window, 0.45 ms for ten. Non-finite
/// samples are skipped and count as missing. If the capture times of the samples are known, the mean has
/// their middle as its time.
class ForceMean {
 public:
  void add(const Vector3& force_n, const Vector3& torque_n_mm) noexcept;
  /// Adds a sample captured at `time_ns`, on the clock of take().
  void add(const Vector3& force_n, const Vector3& torque_n_mm, std::int64_t time_ns) noexcept;
  /// Writes force, torque and count into the sample and starts over. With no sample since the last call the
  /// previous mean is kept and sample_status::kForceMissing is set.
  void take(RigSample& sample) noexcept;
  /// Takes the mean at `now_ns`, for samples with capture times: also fills force_mean_age_ns, which exceeds
  /// any limit until there was a sample.
  void take(RigSample& sample, std::int64_t now_ns) noexcept;

 private:
  Vector3 force_sum_n_;
  Vector3 torque_sum_n_mm_;
  Vector3 last_force_n_;
  Vector3 last_torque_n_mm_;
  std::uint32_t count_ = 0;
  std::int64_t first_time_ns_ = 0;  ///< of the mean in progress
  std::int64_t sum_since_first_ns_ = 0;
  std::int64_t mean_time_ns_ = 0;
  bool has_mean_time_ = false;
};

}  // namespace hapticd::hal
