#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/openhaptics/hd_library.h"
#include "hal/openhaptics/openhaptics_config.h"
#include "hal/openhaptics/servo.h"
#include "hal/rig.h"

namespace hapticd::openhaptics {

/// Properties reported by the open device.
struct DeviceFacts {
  std::string loaded_library;
  std::string model_type, vendor, serial_number, driver_version;
  double max_force_n = 0.0;             ///< as read; 0 = not reported or not plausible
  double max_continuous_force_n = 0.0;  ///< as read
  double max_stiffness_n_per_mm = 0.0;  ///< as read: the stiffest wall the vendor recommends
  double force_ramping_rate_n_per_s = 0.0;
  std::optional<bool> force_ramping, max_force_clamping, software_force_limit;  ///< as the vendor set them
  bool output_stays_off = false;  ///< when switching on was tried
  int calibration_styles = 0;     ///< bits, as read
  bool calibration_known = true;
  double force_limit_n = 0.0;  ///< limit used by the driver
  std::string lacking;         ///< optional functions that the library does not have
};

/// A device from hdInitDevice to hdDisableDevice. Every function may be kept waiting by the vendor's library
/// and is to be called through a VendorThread; a session that hangs is kept alive by the thread that hangs in
/// it.
class DeviceSession {
 public:
  explicit DeviceSession(const OpenHapticsConfig& config) : config_(config) {}
  ~DeviceSession() { close(); }
  DeviceSession(const DeviceSession&) = delete;
  DeviceSession& operator=(const DeviceSession&) = delete;

  /// Loads the library, opens the device, reads its limits, calibrates it if possible and tests the force
  /// output. If any step fails, everything is undone.
  std::optional<hal::Error> open();
  /// Force off, callback scheduled, scheduler started.
  std::optional<hal::Error> start();
  /// Stops the servo after the callback's last turn.
  void stop();
  /// Stops a servo whose callback had no last turn: tries a frame without force from this thread.
  void stop_dead(bool frame_is_ours);
  /// Force off, device closed, library unloaded if nothing else uses it.
  void close();

  // -- after open()
  const DeviceFacts& facts() const noexcept { return facts_; }
  const std::shared_ptr<HdLibrary>& library() const noexcept { return library_; }
  Servo& servo() noexcept { return *servo_; }
  const std::shared_ptr<DeviceErrorSlot>& slot() const noexcept { return slot_; }

 private:
  std::optional<hal::Error> init();
  std::optional<hal::Error> prepare();
  void read_facts();
  bool calibrate();
  std::optional<hal::Error> try_force();
  std::optional<hal::Error> failure(const std::string& what, const std::string& value);
  std::optional<double> number(hd::Enum what);
  std::optional<bool> enabled(hd::Enum what);
  std::optional<int> integer(hd::Enum what);
  std::string text(hd::Enum what);
  void make_current();

  const OpenHapticsConfig config_;
  std::shared_ptr<HdLibrary> library_;
  hd::Handle device_ = hd::kInvalidHandle;
  std::shared_ptr<DeviceErrorSlot> slot_;
  DeviceFacts facts_;
  std::unique_ptr<Servo> servo_;
  hd::SchedulerHandle scheduled_ = 0;
  bool is_scheduled_ = false;
};

}  // namespace hapticd::openhaptics
