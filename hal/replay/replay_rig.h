#pragma once

#include <memory>
#include <string>

#include "hal/error.h"
#include "hal/replay/column_mapping.h"
#include "hal/rig.h"

namespace hapticd::replay {

struct ReplayConfig {
  std::string path{};
  ColumnMapping time{};
  ColumnMapping force{};       ///< reaction along the press axis, positive when the object pushes back
  ColumnMapping position{};    ///< along the press axis, positive into the object
  bool decimal_comma = false;  ///< of a CSV file
  double rate_hz = 1000.0;
  /// True: as fast as possible (the file is the clock). False: at recorded speed, paced by the loop.
  bool as_fast_as_possible = true;
  bool loop = false;  ///< start again at the end (without contact for half a second in between)
  /// The mean force over this first time span becomes zero force, like a sensor bias before contact. 0 =
  /// the force as recorded.
  double bias_s = 0.0;
};

/// A recording as a rig: position and force of a CSV file, resampled to the loop rate by linear
/// interpolation (which adds no overshoot). Commands have no effect: the replay shows what would have been
/// rendered, not what the user would have felt. The press axis is -z: depth d is presented as tip position
/// z = -d.
///
/// The last force is held while the sensor was silent, by the ages of its force in the file. In a file
/// without them a step in time of more than five times the median step is such a gap. Through it every tick
/// carries sample_status::kForceMissing and a growing force_age_ns, exactly as when a sensor falls silent,
/// and a guard that watches the age latches. The same holds when reading goes on after the end.
class ReplayRig final : public hal::Rig {
 public:
  /// Reads and checks the whole file: missing or unknown column or unit, non-finite or non-numeric cell (with
  /// line), time that does not increase, fewer than two rows, unreadable file.
  static hal::Result<std::unique_ptr<ReplayRig>> open(const ReplayConfig& config);
  ~ReplayRig() override;

  const hal::RigInfo& info() const noexcept override;
  bool owns_clock() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand&) noexcept override {}
  bool exhausted() const noexcept override;
  /// Duration of one pass through the file.
  double duration_s() const noexcept;

 private:
  struct State;
  explicit ReplayRig(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::replay
