#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "hal/rig.h"

namespace hapticd::skeleton {

/// The calls of the device's own interface. In a real driver they are calls of the vendor's library.
class DeviceLink {
 public:
  virtual ~DeviceLink() = default;
  /// Opens the connection; may take seconds. False: no device answers.
  virtual bool open() = 0;
  virtual void close() noexcept = 0;
  /// Position of the tool tip in the rig's frame (right-handed, z up), mm. Called once a tick: it neither
  /// blocks nor allocates. False: the device did not answer.
  virtual bool read_position(hal::Vector3& position_mm) noexcept = 0;
  /// Force on the tool tip in the rig's frame, N. As read_position(), and from any thread.
  virtual bool write_force(const hal::Vector3& force_n) noexcept = 0;
};

/// A template for a driver: the shortest one that keeps the whole contract of HapticDevice.
///
/// Device of the skeleton. Gives no force while it is not engaged, while the device does not answer
/// (kDeviceFault), for a command that is not finite, and after `watchdog_ms` without a command until a read()
/// has reported it (kCommandStale). A command beyond the limit is scaled down and reported
/// (kDeviceOverForce).
class SkeletonDevice final : public hal::HapticDevice {
 public:
  /// Opens nothing. `info`: what the device is and can do. `watchdog_ms`: 2 … 1000. Errors: a value out of
  /// range.
  static hal::Result<std::unique_ptr<SkeletonDevice>> create(const hal::DeviceInfo& info, double watchdog_ms,
                                                             std::unique_ptr<DeviceLink> link);
  ~SkeletonDevice() override;

  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::PartReport report() const override;
  const hal::DeviceInfo& info() const noexcept override { return info_; }
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;
  void write_zero_in_crash() noexcept override;

 private:
  SkeletonDevice(const hal::DeviceInfo& info, double watchdog_ms, std::unique_ptr<DeviceLink> link);
  void watch() noexcept;

  const hal::DeviceInfo info_;
  const std::int64_t watchdog_ns_;
  const std::unique_ptr<DeviceLink> link_;

  hal::Vector3 last_position_mm_;  ///< of the clock's thread alone

  std::thread watchdog_;
  std::atomic<bool> engaged_{false};
  std::atomic<bool> faulty_{false};      ///< the device did not answer in this tick or the last one
  std::atomic<bool> written_{true};      ///< it took the last force
  std::atomic<bool> over_force_{false};  ///< the last command was more than it gives
  std::atomic<bool> cut_{false};         ///< the watchdog cut the force; not reported yet
  std::atomic<bool> crashed_{false};
  std::atomic<std::int64_t> last_command_ns_{0};  ///< 0: none since the last cut
};

}  // namespace hapticd::skeleton
