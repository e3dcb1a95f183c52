#pragma once

#include <memory>
#include <vector>

#include "hal/daq/board.h"
#include "hal/phantom/phantom_config.h"
#include "hal/rig.h"

namespace hapticd::phantom {

/// A PHANToM Premium through an analog and digital board, without the vendor's library. Rig frame:
/// right-handed, z up, x away from the device's column when the arm points straight ahead, y to the left.
///
/// The encoders are incremental: after engage() the device is kDeviceNotReady and gives no force until the
/// arm rests in its reset pose and home() was called. It gives none either while it is kDeviceFault or
/// kDeviceOverSpeed, and after the watchdog cut it until a read() has reported so (kCommandStale).
///
/// kDeviceFault: counters or outputs of the board fail; an encoder has jumped (until home()); the arm is
/// beyond its stops, so the counts are not its own; a winding is hotter than it may be (until it has cooled).
/// kDeviceWarm: a winding is past 0.8 of what it bears for ever; the current allowed falls from here on.
/// kDeviceOverForce: the last command was more than the currents allow and was scaled, direction kept.
class PhantomDevice final : public hal::HapticDevice {
 public:
  /// Opens nothing. Errors: values that make no sense, a board without three outputs or enough counters.
  static hal::Result<std::unique_ptr<PhantomDevice>> create(const PhantomConfig& config,
                                                            std::shared_ptr<daq::Board> board);
  ~PhantomDevice() override;

  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::PartReport report() const override;
  const hal::DeviceInfo& info() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;
  void write_zero_in_crash() noexcept override;

  /// Takes the pose the arm rests in for its reset pose, as soon as it has rested for home_still_ms while
  /// read() is called. Any thread; does not wait. Error: not engaged.
  std::optional<hal::Error> home() override;
  bool homed() const noexcept;
  /// What the figures of this device rest on.
  std::vector<hal::UncertainParameter> uncertain() const override;

 private:
  struct State;
  explicit PhantomDevice(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::phantom
