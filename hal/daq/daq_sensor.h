#pragma once

#include <memory>
#include <string>

#include "hal/daq/board.h"
#include "hal/daq/calibration.h"
#include "hal/rig.h"

namespace hapticd::daq {

struct DaqSensorConfig {
  std::string calibration_file{};  ///< the .cal file of this sensor
  std::string part_number{};       ///< which calibration of the file; empty = the only one
  std::string axes = "+x +y +z";   ///< the tool's axes in the sensor's
  /// Share of the converter's or the gauges' range, whichever ends first, beyond which a gauge counts as
  /// saturated.
  double saturation_share = 0.98;
  bool bias_on_engage = true;     ///< take the load as zero when engaged for the first time
  double engage_timeout_s = 3.0;  ///< for the first scans
  double tool_mass_g = 0.0;       ///< beyond the sensor; 0 = unknown
};

/// A six-gauge ATI sensor on an analog board: load = matrix · (V - V_bias), mean of the scans since the
/// last tick. Status: kForceMissing when no scan came, kForceSaturated when a gauge was near an end in any
/// scan, kForceWarning when the board lost scans or some were not finite, kForceFault when none was finite,
/// kForceLost when the acquisition has stopped or the board is gone.
class DaqSensor final : public hal::ForceSensor {
 public:
  /// Reads and checks the calibration; opens nothing. Errors: those of load_calibration(), axes that are
  /// not a permutation, a board without six inputs.
  static hal::Result<std::unique_ptr<DaqSensor>> create(const DaqSensorConfig& config,
                                                        std::shared_ptr<Board> board);
  ~DaqSensor() override;

  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::PartReport report() const override;
  const hal::SensorInfo& info() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  /// Takes the mean of the last 0.25 s as zero; the next read() that has this mean applies it. Error: no
  /// read() had one within a second, or another bias is being taken; then the zero stays what it is.
  std::optional<hal::Error> bias() override;

  const Calibration& calibration() const noexcept;

 private:
  struct State;
  explicit DaqSensor(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::daq
