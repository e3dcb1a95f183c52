#pragma once

#include <cstdint>
#include <optional>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::server {

/// Checks why an identification that needs the force sensor cannot go on: nothing fresh comes from it or from
/// the device, the sensor was never biased, or its zero changed under way.
class SampleMonitor {
 public:
  static constexpr double kMaxSilenceS = 1.0;

  /// Makes a check. `needs_bias`: the reading itself is used, not only how it changes.
  explicit SampleMonitor(bool needs_bias) : needs_bias_(needs_bias) {}

  /// Checks each sample, with its time since the first.
  std::optional<hal::Error> look(const hal::RigSample& sample, double now_s) {
    using namespace hal::sample_status;
    if ((sample.status & (kDeviceFault | kDeviceNotReady)) == 0) device_fit_s_ = now_s;
    if (now_s - device_fit_s_ > kMaxSilenceS) {
      return hal::Error{"the device was unfit for a second", "haptic device", "", "",
                        "see in 'hapticctl doctor' what is wrong with it, then start again"};
    }
    const bool fresh = sample.force_count > 0 && (sample.status & (kForceMissing | kForceLost)) == 0;
    if (!fresh) {
      if (now_s - fresh_s_ < kMaxSilenceS) return std::nullopt;
      return hal::Error{"nothing fresh came from the force sensor for a second", "force sensor", "", "",
                        "see in 'hapticctl doctor' what holds it back, then start again"};
    }
    fresh_s_ = now_s;
    if (needs_bias_ && sample.bias_serial == 0) {
      return hal::Error{"the force sensor was never biased: what it reads at rest would count as a load",
                        "force sensor", "", "", "free the tool, 'hapticctl sensor bias', then start again"};
    }
    if (!serial_) serial_ = sample.bias_serial;
    if (*serial_ != sample.bias_serial) {
      return hal::Error{"the zero of the force sensor changed under way", "force sensor", "", "",
                        "see in 'hapticctl status' whether the bias is lost; start again"};
    }
    return std::nullopt;
  }

 private:
  bool needs_bias_;
  double fresh_s_ = 0.0;
  double device_fit_s_ = 0.0;
  std::optional<std::uint32_t> serial_;
};

}  // namespace hapticd::server
