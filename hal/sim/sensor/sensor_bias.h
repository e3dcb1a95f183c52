#pragma once

#include <chrono>
#include <cstdint>

#include "hal/bias_request.h"
#include "hal/samples.h"
#include "hal/sim/sensor/nano17.h"

namespace hapticd::sim {

/// A bias asked for by one thread and taken by the one that reads the sensor.
class SensorBias {
 public:
  static constexpr std::int64_t kMeanNs = 250'000'000;

  /// Waits until one was taken. False: it was not in time, or another one is pending, and the zero stays.
  bool take(std::chrono::milliseconds timeout) noexcept {
    const std::uint64_t number = request_.ask();
    return number != 0 && request_.await(number, timeout);
  }

  /// Follows the zero: each reading passes here and gets the serial number of its zero. The rig starts with a
  /// first bias.
  void follow(hal::RigSample& sample, std::int64_t now_ns, Nano17& sensor) noexcept {
    const std::uint64_t wanted = request_.wanted();
    sample.bias_serial = 1 + static_cast<std::uint32_t>(request_.count());
    if (wanted != gathered_for_) {  // the one before was taken or withdrawn
      gathered_for_ = wanted;
      force_n_ = torque_n_mm_ = {};
      count_ = 0;
    }
    if (wanted == 0 || sample.force_count == 0) return;
    if (count_ == 0) since_ns_ = now_ns;
    force_n_ = force_n_ + sample.sensor_force_n;
    torque_n_mm_ = torque_n_mm_ + sample.sensor_torque_n_mm;
    ++count_;
    if (now_ns - since_ns_ < kMeanNs || !request_.claim(wanted)) return;
    sensor.bias(force_n_ * (1.0 / count_), torque_n_mm_ * (1.0 / count_));
    request_.note_taken(wanted);
  }

 private:
  hal::BiasRequest request_;
  std::uint64_t gathered_for_ = 0;
  std::int64_t since_ns_ = 0;
  hal::Vector3 force_n_, torque_n_mm_;
  int count_ = 0;
};

}  // namespace hapticd::sim
