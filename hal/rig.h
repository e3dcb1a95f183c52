#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/part_report.h"
#include "hal/samples.h"

namespace hapticd::hal {

/// A parameter that is known only roughly. Rigs list theirs, so that each figure measured on them can be
/// read together with its assumptions.
struct UncertainParameter {
  std::string name;  ///< e.g. "structural_mode_hz"
  double value = 0.0;
  std::string unit;
  std::string source;  ///< origin of the value and how far it can be trusted
};

/// Limits and properties of a force-feedback device, along any one axis at the tool tip.
struct DeviceInfo {
  std::string model;  ///< e.g. "phantom_1_0"; empty when the rig has no device
  double max_force_n = 0.0;
  double max_continuous_force_n = 0.0;
  double position_resolution_mm = 0.0;
  double structural_stiffness_n_per_mm = 0.0;
  double apparent_mass_g = 0.0;
  double coulomb_friction_n = 0.0;  ///< back-drive friction, data sheet; 0 = unknown
  double structural_mode_hz = 0.0;  ///< lowest mode of the bare device, free; 0 = unknown
};

/// Properties of a force sensor.
struct SensorInfo {
  std::string model;  ///< e.g. "nano17_si_25"; empty when the rig has none
  double range_n = 0.0;
  double resolution_n = 0.0;
  double sample_rate_hz = 0.0;
  double tool_mass_g = 0.0;  ///< mass beyond the sensor, 0 when unknown
};

enum class RigKind : std::uint8_t { kSimulated, kReplay, kHardware };

/// Properties of a rig; fixed while it exists.
struct RigInfo {
  RigKind kind = RigKind::kSimulated;
  std::string name;  ///< e.g. "sim:phantom_1_0"
  double rate_hz = 1000.0;
  DeviceInfo device;
  SensorInfo sensor;
  bool renders_force = true;           ///< false if commands have no effect (a recording)
  bool has_truth = false;              ///< true if truth() returns data
  bool has_external_position = false;  ///< true if external_position() returns data
  std::vector<UncertainParameter> uncertain;
};

/// Common base of device and sensor: hardware that is opened when it is needed.
class RigPart {
 public:
  virtual ~RigPart() = default;
  /// Opens the hardware and returns when it delivers data, or returns why it does not. Does nothing if
  /// already engaged. Any thread but the clock's; may take seconds, but always returns.
  virtual std::optional<Error> engage() { return std::nullopt; }
  /// Releases the hardware: no socket, port or device node stays open. Not while the clock runs on it.
  virtual void disengage() noexcept {}
  /// State of the part. Any thread; takes no lock that the clock's thread takes.
  virtual PartReport report() const = 0;
};

/// Makes the tick happen; reported by a clock.
class ServoBody {
 public:
  virtual ~ServoBody() = default;
  virtual void on_servo() noexcept = 0;
};

/// The scheduler of a device that has its own.
class ServoClock {
 public:
  virtual ~ServoClock() = default;
  /// Calls the body once a period, on a thread of the scheduler, until `stop` is set, or the scheduler has
  /// died or cannot be started; then the device has to be engaged again. Returns when no call is in
  /// progress.
  virtual void run(ServoBody& body, const std::atomic<bool>& stop) noexcept = 0;
};

/// Device half of a sample, and output of force. Implementations neither block nor allocate in read() and
/// write().
class HapticDevice : public RigPart {
 public:
  virtual const DeviceInfo& info() const noexcept = 0;
  /// Fills position, orientation and the device's status bits; changes nothing else. Not engaged: the last
  /// known position and kDeviceNotReady.
  virtual void read(RigSample& sample) noexcept = 0;
  /// Force on the tip from now on; takes effect after the device's own latency.
  virtual void write(const DeviceCommand& command) noexcept = 0;
  /// Writes, in a crash of the process, zero force, and only zero from now on. Called in a signal handler
  /// while other threads run; async-signal-safe except for the calls of the device itself, bounded to some
  /// tens of milliseconds. Does nothing if the device does not support it.
  virtual void write_zero_in_crash() noexcept {}
  /// Takes the present pose as the reset pose, once the device has rested while it is read; does not wait
  /// for that. Error: the device needs no homing. Any thread but the clock's.
  virtual std::optional<Error> home() {
    return Error{"the device homes itself", "haptic device", "", "", "there is nothing to do"};
  }
  /// Uncertain parameters of the rig.
  virtual std::vector<UncertainParameter> uncertain() const { return {}; }
  /// Null if a periodic thread may read and write the device.
  virtual ServoClock* clock() noexcept { return nullptr; }
};

/// Sensor half of a sample.
class ForceSensor : public RigPart {
 public:
  virtual const SensorInfo& info() const noexcept = 0;
  /// Fills force, torque, count, age and the sensor's status bits with the mean since the last call;
  /// changes nothing else. Neither blocks nor allocates. Not engaged: kForceMissing and an age beyond any
  /// limit.
  virtual void read(RigSample& sample) noexcept = 0;
  /// Takes the present reading as zero. Call it only with the tool out of contact and at rest. Any thread
  /// but the clock's; waits for the samples that it averages. Error: no samples arrive.
  virtual std::optional<Error> bias() = 0;
};

/// Called once a period by the owner of the clock.
class TickHandler {
 public:
  virtual ~TickHandler() = default;
  virtual DeviceCommand on_tick(const RigSample& sample) noexcept = 0;
};

/// The parts that can have hardware.
enum class RigPartKind : std::uint8_t { kDevice, kForceSensor };

/// Device, sensor and clock. Three kinds:
/// - a *paced* rig has no clock: a periodic thread calls read() and write() once a period;
/// - a rig whose device has a scheduler (`clock()` is not null): the scheduler calls read() and write();
/// - a rig that owns its time (`owns_clock()`: virtual time, a file) is given the handler by run() and calls
///   it itself.
class Rig {
 public:
  virtual ~Rig() = default;
  virtual const RigInfo& info() const noexcept = 0;

  virtual bool owns_clock() const noexcept = 0;
  virtual ServoClock* clock() noexcept { return nullptr; }

  /// Opens the hardware of a part and returns when it delivers data, or returns why it does not. Any
  /// thread; never in a tick. The clock may be running: before this, and after disengage(), the samples
  /// mark the part as absent. Does nothing without hardware.
  virtual std::optional<Error> engage(RigPartKind /*part*/) { return std::nullopt; }
  /// Releases it again; on the same thread as engage().
  virtual void disengage(RigPartKind /*part*/) noexcept {}
  /// Reports of the parts with hardware. Any thread.
  virtual std::vector<PartReport> reports() const { return {}; }
  /// Takes the present load of the sensor as zero: the tool must be out of contact and at rest. Waits for
  /// the samples that it averages.
  virtual std::optional<Error> bias_force_sensor() { return nothing_to("bias", "force sensor"); }
  /// Takes the present pose of the device as its reset pose; does not wait until it rests.
  virtual std::optional<Error> home_device() { return nothing_to("home", "haptic device"); }

  /// Reads the next measurement. Bounded time, no allocation.
  virtual void read(RigSample& sample) noexcept = 0;
  virtual void write(const DeviceCommand& command) noexcept = 0;
  /// HapticDevice::write_zero_in_crash() of its device.
  virtual void write_zero_in_crash() noexcept {}
  /// True when there is nothing more to read (a recording has ended).
  virtual bool exhausted() const noexcept { return false; }
  /// Reads the true state at the last sample; false if there is none.
  virtual bool truth(TruthSample&) const noexcept { return false; }

  /// Reads the tip's position measured by an external instrument (an LVDT, a laser), rig frame, at the last
  /// sample; false if there is none. Unlike the encoders it sees the device bend.
  virtual bool external_position(Vector3& /*position_mm*/) const noexcept { return false; }

  /// Drives the handler until the rig is exhausted or `stop` is set, as fast as possible (virtual time).
  /// Always writes a zero force before it returns.
  virtual void run(TickHandler& handler, const std::atomic<bool>& stop) noexcept {
    RigSample sample;
    while (!stop.load(std::memory_order_relaxed) && !exhausted()) {
      read(sample);
      write(handler.on_tick(sample));
    }
    write(DeviceCommand{});
  }

 protected:
  static Error nothing_to(const char* action, const char* part) {
    return {std::string("there is nothing to ") + action, part, "", "a rig with hardware that needs it", ""};
  }
};

}  // namespace hapticd::hal
