#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/lock/mutex.h"
#include "hal/openhaptics/device_error_slot.h"
#include "hal/openhaptics/hd_api.h"

namespace hapticd::openhaptics {

/// The vendor's library, loaded at run time and shared by all devices that use the same file: it has one
/// scheduler and one stack of errors, whatever the number of devices.
class HdLibrary : public std::enable_shared_from_this<HdLibrary> {
 public:
  static constexpr std::size_t kSlots = 4;
  /// Maximum number of errors on the stack of hdGetError; more is treated as a fault of the library.
  static constexpr int kMaxStackDepth = 32;

  /// Loads the first of the names (or paths) that has all required functions. Blocks as long as the
  /// library's own initialisation.
  static hal::Result<std::shared_ptr<HdLibrary>> load(const std::vector<std::string>& names);
  /// Unloads, unless it was abandoned.
  ~HdLibrary();
  HdLibrary(const HdLibrary&) = delete;
  HdLibrary& operator=(const HdLibrary&) = delete;

  const hd::Api& api() const noexcept { return api_; }
  const std::string& name() const noexcept { return name_; }
  /// Names of the missing optional functions.
  const std::vector<std::string>& lacking() const noexcept { return lacking_; }

  /// Starts the scheduler, which runs while at least one device uses it. Blocks as long as the vendor's call.
  void start_scheduler();
  void stop_scheduler();

  /// The error slot of a device; null when all are in use. Outlives the library, so that its counts can
  /// still be read.
  std::shared_ptr<DeviceErrorSlot> acquire_slot(hd::Handle device) noexcept;
  static void release_slot(DeviceErrorSlot& slot) noexcept { slot.device.store(hd::kInvalidHandle); }
  /// Takes all errors off the stack, each to the slot of its device; those of no known device go to `mine`.
  /// Wait-free but for the library's own doing. Returns how many there were; kMaxStackDepth means that there
  /// may be more.
  int drain(DeviceErrorSlot& mine) noexcept;
  /// Stores one error in the slot of its device.
  void deliver(const hd::ErrorInfo& error, DeviceErrorSlot& mine) noexcept;
  /// Returns, outside the callback, the most recent error that does not belong to another device, or
  /// kSuccess; the others are dropped.
  hd::ErrorInfo last_error(hd::Handle mine) noexcept;
  /// "HD_COMM_ERROR (0x302, internal 5): what the library says".
  std::string describe(const hd::ErrorInfo& error) const;

  /// Abandons the library in which a thread hangs: it is never unloaded and never used again.
  void abandon();
  bool abandoned() const noexcept { return abandoned_.load(); }

 private:
  HdLibrary(void* handle, std::string name) : handle_(handle), name_(std::move(name)) {}
  std::optional<hal::Error> bind();
  DeviceErrorSlot* slot_of(hd::Handle device) noexcept;

  void* handle_;
  std::string name_;
  hd::Api api_;
  std::vector<std::string> lacking_;
  SerialMutex scheduler_;
  int scheduler_users_ GUARDED_BY(scheduler_) = 0;
  std::shared_ptr<std::array<DeviceErrorSlot, kSlots>> slots_ =
      std::make_shared<std::array<DeviceErrorSlot, kSlots>>();
  std::atomic<bool> abandoned_{false};
};

}  // namespace hapticd::openhaptics
