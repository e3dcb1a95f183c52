#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::server {

class TelemetryHub;

/// Watches whether the tool is left alone: what the force sensor reads and where the tip is, on its own
/// thread for as long as it lives. A zero taken while a hand begins to press makes free air read as a pull.
class StillnessMonitor {
 public:
  /// What a hand's tremor leaves in a mean over 50 ms, and a lean of a quarter of a newton a second.
  static constexpr double kMaxForceChangeN = 0.1;
  static constexpr double kMaxTravelMm = 3.0;

  explicit StillnessMonitor(TelemetryHub& hub);
  ~StillnessMonitor();
  StillnessMonitor(const StillnessMonitor&) = delete;
  StillnessMonitor& operator=(const StillnessMonitor&) = delete;

  /// Change so far, if there was any: `kMaxForceChangeN` or `kMaxTravelMm` passed.
  std::optional<hal::Error> disturbance() const;

 private:
  void run();

  TelemetryHub& hub_;
  std::atomic<double> force_change_n_{0.0};
  std::atomic<double> travel_mm_{0.0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::server
