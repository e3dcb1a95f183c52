#pragma once

#include <atomic>
#include <cstdint>

#include "hal/samples.h"
#include "hal/sim/sensor/nano17.h"

namespace hapticd::sim {

/// A bias asked for by one thread and taken by the one that reads the sensor.
class SensorBias {
 public:
  static constexpr std::int64_t kMeanNs = 250'000'000;

  /// Asks for one; its number. One at a time.
  std::uint32_t ask() noexcept { return asked_.fetch_add(1, std::memory_order_acq_rel) + 1; }
  bool taken(std::uint32_t number) const noexcept { return taken_.load(std::memory_order_acquire) >= number; }

  /// Each reading passes here; it gets the serial number of its zero. The rig starts with a first bias.
  void follow(hal::RigSample& sample, std::int64_t now_ns, Nano17& sensor) noexcept {
    const std::uint32_t asked = asked_.load(std::memory_order_acquire);
    std::uint32_t taken = taken_.load(std::memory_order_relaxed);
    sample.bias_serial = 1 + taken;
    if (asked == taken || sample.force_count == 0) return;
    if (count_ == 0) since_ns_ = now_ns;
    force_n_ = force_n_ + sample.sensor_force_n;
    torque_n_mm_ = torque_n_mm_ + sample.sensor_torque_n_mm;
    ++count_;
    if (now_ns - since_ns_ < kMeanNs) return;
    sensor.bias(force_n_ * (1.0 / count_), torque_n_mm_ * (1.0 / count_));
    force_n_ = torque_n_mm_ = {};
    count_ = 0;
    taken_.store(asked, std::memory_order_release);
  }

 private:
  std::atomic<std::uint32_t> asked_{0};
  std::atomic<std::uint32_t> taken_{0};
  std::int64_t since_ns_ = 0;
  hal::Vector3 force_n_, torque_n_mm_;
  int count_ = 0;
};

}  // namespace hapticd::sim
