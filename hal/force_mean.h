#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::hal {

/// Mean of the sensor samples that arrived since the last tick (D§3.2.2: ten at 10 kHz). Halves neither
/// bandwidth nor promptness the way a recursive filter would: the delay is half the window, 0.45 ms for ten.
/// Non-finite samples are left out and counted as missing. Where the samples' instants are known, so is the
/// one the mean stands for: their middle.
class ForceMean {
 public:
  void add(const Vector3& force_n, const Vector3& torque_n_mm) noexcept;
  /// The same for a sample taken at `time_ns`, by the clock of take().
  void add(const Vector3& force_n, const Vector3& torque_n_mm, std::int64_t time_ns) noexcept;
  /// Writes force, torque and count into the sample and starts over. With no sample since the last call the
  /// previous mean is kept and sample_status::kForceMissing is set.
  void take(RigSample& sample) noexcept;
  /// The same at `now_ns`, for samples with instants: fills force_mean_age_ns too; beyond any limit as long
  /// as there was no sample.
  void take(RigSample& sample, std::int64_t now_ns) noexcept;

 private:
  Vector3 force_sum_n_;
  Vector3 torque_sum_n_mm_;
  Vector3 last_force_n_;
  Vector3 last_torque_n_mm_;
  std::uint32_t count_ = 0;
  std::int64_t first_time_ns_ = 0;  ///< of the mean under way
  std::int64_t sum_since_first_ns_ = 0;
  std::int64_t mean_time_ns_ = 0;
  bool has_mean_time_ = false;
};

}  // namespace hapticd::hal
