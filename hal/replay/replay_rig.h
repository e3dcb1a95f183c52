#pragma once

#include <memory>
#include <string>

#include "hal/error.h"
#include "hal/rig.h"

namespace hapticd::replay {

/// Which column of a recording holds what, in which unit. An empty column name means: find it by its name and unit
/// suffix ("time_s", "force_N", "indentation_mm", "position_mm").
struct ColumnMapping {
  std::string column;
  std::string unit;    ///< "s", "ms"; "N", "mN", "uN"; "mm", "um", "m"; empty = the suffix of the column's name
  double scale = 1.0;  ///< applied after the unit: how a µN recording is shown to a service that thinks in N
};

struct ReplayConfig {
  std::string path;
  ColumnMapping time;
  ColumnMapping force;     ///< reaction along the press axis, positive when the object pushes back
  ColumnMapping position;  ///< along the press axis, positive into the object
  double rate_hz = 1000.0;
  /// True: as fast as possible (the file is the clock). False: at recorded speed, paced by the loop.
  bool as_fast_as_possible = true;
  bool loop = false;  ///< start over at the end (with the tool taken as free in between)
};

/// A recording as a rig: position and force of a CSV file, resampled to the loop rate by linear interpolation
/// (which invents no overshoot). Commands go nowhere: the recording shows what would have been rendered, not
/// what the user would have felt. The press axis is -z: depth d is presented as tip position z = -d.
class ReplayRig final : public hal::Rig {
 public:
  /// Reads and checks the whole file: missing or unknown column or unit, non-finite or non-numeric cell (with line),
  /// time that does not increase, fewer than two rows, unreadable file.
  static hal::Result<std::unique_ptr<ReplayRig>> open(const ReplayConfig& config);
  ~ReplayRig() override;

  const hal::RigInfo& info() const noexcept override;
  bool owns_clock() const noexcept override;
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand&) noexcept override {}
  bool exhausted() const noexcept override;
  double duration_s() const noexcept;

 private:
  struct State;
  explicit ReplayRig(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::replay
