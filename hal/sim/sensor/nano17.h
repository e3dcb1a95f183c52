#pragma once

#include <cstdint>
#include <vector>

#include "hal/force_mean.h"
#include "hal/rig.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/random.h"
#include "hal/sim/sensor/sensor_zero.h"

namespace hapticd::sim {

/// The force/torque sensor at 10 kHz: noise, quantisation, saturation, software bias. Figures: SI-25-0.25 on
/// a 16-bit board, 1/640 N and ±35 N along the tool (D§3.1), ±25 N across. Noise: the 10 mN of jitter under
/// load that D§3.2.2 reports is read as five standard deviations of the ten-sample mean.
class Nano17 {
 public:
  /// `step_s`: between two samples. `samples_wait`: whether samples are ever late or lost on their way; then
  /// they are kept until they arrive.
  Nano17(double tool_mass_kg, std::uint64_t seed, const Conditions& conditions = {}, double step_s = 1e-4,
         bool samples_wait = false);

  /// Measures one 10 kHz sample of the true load on the sensor, tool frame.
  void measure(const hal::Vector3& force_n) noexcept;
  /// Measures with a torque about the sensor's origin [N·mm] and separate channels for it, instead of the
  /// torque that the force makes at the tip.
  void measure(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept;

  const hal::SensorInfo& info() const noexcept { return info_; }
  /// How the samples since the last reading arrive.
  struct Arrival {
    std::int64_t beyond_ns = 0;  ///< the reading comes so long after the newest sample was made
    std::int64_t late_ns = 0;    ///< the newest that has arrived is so much older; the rest comes later
    bool lost = false;           ///< what was made since the last reading never arrives
  };
  void read(hal::RigSample& sample, const Arrival& arrival) noexcept;
  void read(hal::RigSample& sample) noexcept { read(sample, Arrival{}); }
  /// Takes what it reads without load; from now on that is zero.
  void bias(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) noexcept;
  /// Takes a known load as zero, as a bias with the tool at rest, but without its noise.
  void bias_at(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm = {}) noexcept {
    bias_n_ = zero_.crossed(force_n);
    torque_bias_n_mm_ = torque_n_mm;
  }

  static constexpr double kLeverMm = 60.0;  ///< from its origin to the tip, along -z of the tool

 private:
  struct Reading {
    hal::Vector3 force_n;
    hal::Vector3 torque_n_mm;
  };
  hal::Vector3 reading_n(const hal::Vector3& force_n) noexcept;
  void send(const Reading& reading) noexcept;
  /// Adds the readings that have arrived to the mean.
  void deliver(const Arrival& arrival) noexcept;

  hal::SensorInfo info_;
  double noise_n_;  ///< of one sample, each axis
  SensorZero zero_;
  std::int64_t step_ns_;
  std::int64_t measures_;  ///< so many samples; what comes after them repeats the last
  Reading last_;
  std::int64_t delay_ns_;
  bool delay_reported_;
  std::vector<Reading> waiting_;  ///< ring of samples on their way; empty if none is ever late
  std::int64_t made_ = 0;         ///< samples so far
  std::int64_t arrived_ = 0;      ///< those that are no longer on their way
  // What the ages count from, on the rig's clock.
  std::int64_t newest_ns_ = 0;
  std::int64_t mean_ns_ = 0;
  Random random_;
  Random torque_random_;
  hal::ForceMean mean_;
  hal::Vector3 bias_n_;
  hal::Vector3 torque_bias_n_mm_;
  bool saturated_ = false;
};

}  // namespace hapticd::sim
