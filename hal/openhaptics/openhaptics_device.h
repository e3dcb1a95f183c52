#pragma once

#include <memory>

#include "hal/error.h"
#include "hal/openhaptics/openhaptics_config.h"
#include "hal/rig.h"

namespace hapticd::openhaptics {

/// A PHANToM through the vendor's library. The vendor's scheduler is the clock: run() calls the body from
/// inside its callback; call read() and write() only there. run() switches the force on and, at its end,
/// off; in between the driver gives none while the device is faulty (kDeviceFault) or not calibrated
/// (kDeviceNotReady), when nothing was written in a tick, or when the written force is not finite. A force
/// beyond the limit is scaled down to it and reported as kDeviceOverForce with the next sample.
///
/// OpenHaptics device. The library may hang in any call: the caller waits no longer than the configuration
/// says, then the device is kFaulty, and this process never touches the library again.
class OpenHapticsDevice final : public hal::HapticDevice, public hal::ServoClock {
 public:
  /// Checks the configuration; opens nothing.
  static hal::Result<std::unique_ptr<OpenHapticsDevice>> create(const OpenHapticsConfig& config);
  ~OpenHapticsDevice() override;

  /// Loads the library and opens the device. A device that was lost or abandoned is closed and opened
  /// again. A device that is not calibrated yet is engaged too: its samples carry kDeviceNotReady and its
  /// report says what to do.
  std::optional<hal::Error> engage() override;
  /// Ends a run in progress, then closes the device and unloads the library.
  void disengage() noexcept override;
  hal::PartReport report() const override;

  /// Properties from the data sheet until the device is engaged, then with the force limits it shows. They
  /// change in engage() only.
  const hal::DeviceInfo& info() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;
  void write_zero_in_crash() noexcept override;
  hal::ServoClock* clock() noexcept override { return this; }

  /// Returns at once if the device is not engaged or another run is in progress. Waits for a scheduler that
  /// stalls; after `death_s` without a call it is abandoned, and the device has to be engaged again.
  void run(hal::ServoBody& body, const std::atomic<bool>& stop) noexcept override;

 private:
  struct State;
  explicit OpenHapticsDevice(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::openhaptics
