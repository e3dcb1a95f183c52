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
/// beyond its stops, so the counts are wrong; a winding is too hot (until it has cooled). kDeviceWarm: a
/// winding is above 0.8 of its permanent limit; from here on the allowed current falls. kDeviceOverForce:
/// the last command exceeded the allowed currents and was scaled down in the same direction.
class PhantomDevice final : public hal::HapticDevice {
 public:
  /// Opens nothing. Errors: invalid values, a board without three outputs or enough counters.
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

  /// Takes the present pose as the reset pose, as soon as the arm has rested for home_still_ms while read()
  /// is called. Any thread; does not wait. Error: not engaged.
  std::optional<hal::Error> home() override;
  bool homed() const noexcept;
  /// The uncertain parameters of this device.
  std::vector<hal::UncertainParameter> uncertain() const override;

 private:
  struct State;
  explicit PhantomDevice(std::unique_ptr<State> state);
  const std::shared_ptr<State> state_;  ///< shared with what cuts at the process's exit
};

}  // namespace hapticd::phantom
