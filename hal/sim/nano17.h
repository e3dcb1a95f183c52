#pragma once

#include <cstdint>

#include "hal/force_mean.h"
#include "hal/rig.h"
#include "hal/sim/random.h"

namespace hapticd::sim {

/// The force/torque sensor at 10 kHz: noise, quantisation, saturation, software bias. Figures: SI-25-0.25 on
/// a 16-bit board, 1/640 N and ±35 N along the tool (D§3.1), ±25 N across. Noise: the 10 mN of jitter under
/// load that D§3.2.2 reports is read as five standard deviations of the ten-sample mean.
class Nano17 final : public hal::ForceSensor {
 public:
  Nano17(double tool_mass_kg, std::uint64_t seed);

  /// One 10 kHz sample of the true load on the sensor, tool frame.
  void measure(const hal::Vector3& force_n) noexcept;

  const hal::SensorInfo& info() const noexcept override { return info_; }
  void read(hal::RigSample& sample) noexcept override;
  void bias() noexcept override { bias_n_ = bias_n_ + last_mean_n_; }
  /// Known load taken as zero, as after bias() with the tool at rest but without its noise.
  void bias_at(const hal::Vector3& force_n) noexcept { bias_n_ = force_n; }

 private:
  hal::SensorInfo info_;
  Random random_;
  hal::ForceMean mean_;
  hal::Vector3 bias_n_;
  hal::Vector3 last_mean_n_;
  bool saturated_ = false;
};

}  // namespace hapticd::sim
