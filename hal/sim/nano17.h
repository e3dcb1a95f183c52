#pragma once

#include <cstdint>

#include "hal/force_mean.h"
#include "hal/rig.h"
#include "hal/sim/random.h"

namespace hapticd::sim {

/// The force/torque sensor at 10 kHz: noise, quantisation, saturation, software bias. Figures: SI-25-0.25 on
/// a 16-bit board, 1/640 N and ±35 N along the tool (D§3.1), ±25 N across. Noise: the 10 mN of jitter under
/// load that D§3.2.2 reports is read as five standard deviations of the ten-sample mean.
class Nano17 {
 public:
  Nano17(double tool_mass_kg, std::uint64_t seed);

  /// One 10 kHz sample of the true load on the sensor, tool frame.
  void measure(const hal::Vector3& force_n) noexcept;
  /// The same with a torque about the sensor's origin of its own [N·mm] and channels of its own that measure
  /// it, instead of the torque that the force makes at the tip.
  void measure(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept;

  const hal::SensorInfo& info() const noexcept { return info_; }
  void read(hal::RigSample& sample) noexcept;
  void bias() noexcept;
  /// Known load taken as zero, as after bias() with the tool at rest but without its noise.
  void bias_at(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm = {}) noexcept {
    bias_n_ = force_n;
    torque_bias_n_mm_ = torque_n_mm;
  }

  static constexpr double kLeverMm = 60.0;  ///< from its origin to the tip, along -z of the tool

 private:
  hal::Vector3 reading_n(const hal::Vector3& force_n) noexcept;

  hal::SensorInfo info_;
  Random random_;
  Random torque_random_;
  hal::ForceMean mean_;
  hal::Vector3 bias_n_;
  hal::Vector3 last_mean_n_;
  hal::Vector3 torque_bias_n_mm_;
  hal::Vector3 last_mean_torque_n_mm_;
  bool saturated_ = false;
};

}  // namespace hapticd::sim
