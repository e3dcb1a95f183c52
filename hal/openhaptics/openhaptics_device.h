#pragma once

#include <memory>

#include "hal/error.h"
#include "hal/openhaptics/openhaptics_config.h"
#include "hal/rig.h"

namespace hapticd::openhaptics {

/// A PHANToM through the vendor's library. The vendor's scheduler is the clock: run() calls the body from
/// inside its callback, and read() and write() belong in there. Force is switched on by run() and off by its
/// end; in between the driver gives none while the device is unfit (kDeviceFault) or not calibrated
/// (kDeviceNotReady), when nothing was written in a tick, or when what was written is not finite; a force
/// beyond the limit is scaled down to it and reported as kDeviceOverForce with the next sample.
///
/// The library may hang in any call. Then no one waits for it longer than the configuration says, the device
/// is kFaulty, and the library is never touched again by this process.
class OpenHapticsDevice final : public hal::HapticDevice, public hal::ServoClock {
 public:
  /// Checks the configuration; opens nothing.
  static hal::Result<std::unique_ptr<OpenHapticsDevice>> create(const OpenHapticsConfig& config);
  ~OpenHapticsDevice() override;

  /// Loads the library and opens the device. A device that was lost or given up is closed and opened again.
  /// A device that is not calibrated yet is engaged all the same: its samples say kDeviceNotReady and its
  /// report says what to do.
  std::optional<hal::Error> engage() override;
  /// Ends a run that is still under way, then closes the device and unloads the library.
  void disengage() noexcept override;
  hal::PartReport report() const override;

  /// From the data sheet until the device is engaged, then with the force limits it shows. Changes in
  /// engage() only.
  const hal::DeviceInfo& info() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;
  void write_zero_in_crash() noexcept override;
  hal::ServoClock* clock() noexcept override { return this; }

  /// Returns at once where the device is not engaged or another run is under way. A scheduler that stalls is
  /// waited for; one that stays away for `death_s` is given up, and the device is to be engaged again.
  void run(hal::ServoBody& body, const std::atomic<bool>& stop) noexcept override;

 private:
  struct State;
  explicit OpenHapticsDevice(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::openhaptics
