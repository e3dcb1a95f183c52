#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/error.h"
#include "rt/model/identified_model.h"
#include "rt/record/observation.h"

namespace hapticd::identification {

/// Motion that an identification wants next: described in words to a user, done by the simulated hand.
struct MotionRequest {
  enum class Motion : std::uint8_t {
    kRest,        ///< hold the tool still, free
    kSway,        ///< turn and wave the tool in free air
    kPress,       ///< press to `force_n` at `force_rate_n_per_s`, hold, let go
    kTap,         ///< strike at `speed_mm_per_s`, `repetitions` times
    kStroke,      ///< slide back and forth under `force_n` at `speed_mm_per_s`
    kLightTaps,   ///< touch lightly along a line, to scan the surface
    kStrikeFree,  ///< strike at `speed_mm_per_s` in free air
  };
  /// Action of the device meanwhile.
  enum class Device : std::uint8_t {
    kNothing,     ///< no force; only watched
    kWall,        ///< a virtual wall of `stiffness_n_per_mm`, no object
    kModulation,  ///< renders `stiffness_n_per_mm` on the object with the gains below
  };
  Motion motion = Motion::kRest;
  Device device = Device::kNothing;
  double force_n = 0.0;
  double displacement_mm =
      0.0;  ///< kPress: as deep as this below place_mm, in the place of a force; 0 = none
  double force_rate_n_per_s = 0.0;
  double hold_s = 0.0;
  double speed_mm_per_s = 0.0;
  double length_mm = 0.0;  ///< stroke, light taps: of the line, along x from the place on
  double tilt_deg = 0.0;   ///< sway: amplitude
  int repetitions = 1;
  hal::Vector3 place_mm{};  ///< next to (x, y) or above (z) the home of the tool, where it is to happen
  double stiffness_n_per_mm = 0.0;  ///< of the wall or of the target
  double proportional_gain = 0.0;   ///< kModulation
  double derivative_ms = 0.0;
  bool encoders_as_they_are = false;  ///< kModulation: without compensation of the device's bend
  double max_device_force_n = 0.0;    ///< kModulation: of the scene; 0 = the device's own limit
  std::string words;                  ///< "press deeper than 6 mm"; what is missing and why
};

/// Coverage of a plane of conditions.
struct Coverage {
  struct Axis {
    std::string quantity;  ///< "displacement"
    std::string unit;      ///< "mm"
    double from = 0.0;
    double to = 1.0;
    int bins = 1;
  };
  Axis x, y;                           ///< y has no bins if x is all there is
  std::vector<std::uint32_t> counts;   ///< samples per cell, row by row, x fastest
  std::vector<std::uint8_t> required;  ///< 1 where the identification waits for samples
  double share = 0.0;                  ///< of the required cells that have enough
  std::uint32_t enough_samples = 1;    ///< of a cell

  Coverage() = default;
  Coverage(Axis x_axis, Axis y_axis);

  std::size_t cell(int column, int row) const noexcept {
    return static_cast<std::size_t>(row * x.bins + column);
  }
  /// Cell of a place; what lies beyond an end counts in the last bin there, NaN in the first.
  std::size_t cell_at(double at_x, double at_y = 0.0) const noexcept;
  bool has_enough(std::size_t cell_number) const noexcept {
    return required[cell_number] == 0 || counts[cell_number] >= enough_samples;
  }
  /// Sets the share; `without` if nothing is required.
  void update_share(double without = 1.0) noexcept;
};

/// Point to look at: what was measured and what the model makes of it.
struct FitPoint {
  double x = 0.0;
  double measured = 0.0;
  double model = 0.0;
};

struct IdentificationProgress {
  std::uint64_t samples = 0;  ///< that carried information
  double duration_s = 0.0;    ///< of data so far
  std::vector<rt::EstimatedParameter> parameters;
  double residual = 0.0;  ///< rms left over rms explained; NaN before there is a fit
  std::vector<Coverage> coverage;
  std::string fit_x, fit_y;          ///< axis labels with unit, e.g. "displacement [mm]"
  std::vector<FitPoint> fit;         ///< at most 200
  bool steady = false;               ///< the parameters' gradients have died down (D§4.5.1)
  bool certain = false;              ///< their standard errors are small enough
  bool converged = false;            ///< steady, certain and covered
  double completion = 0.0;           ///< 0 … 1, for a progress bar; never falls
  std::vector<std::string> missing;  ///< in words, the most wanted first; empty once converged
  std::vector<std::string> remarks;  ///< what was left out or looks wrong: gaps, saturation
};

/// Identification under way: gets every tick, and is asked now and then. Bounded memory however long it
/// lasts, bounded time per tick; reads no clock and does no I/O. Unfit samples (non-finite, stale, saturated,
/// a gap) are left out and counted in the remarks. Not thread-safe.
class Identification {
 public:
  virtual ~Identification() = default;

  virtual void add(const rt::Observation& observation) = 0;
  /// Motion that should happen next. Asked again once it has been done; ends with kRest when nothing is
  /// wanted.
  virtual MotionRequest next_request() const = 0;
  virtual IdentificationProgress progress() const = 0;
  /// Finishes the model as far as the data go, `converged` or not. An error if they do not show it at all,
  /// saying what is missing. `device`, `sensor`, `object` and `data_reference` are left for the caller.
  virtual hal::Result<rt::IdentifiedModel> finish() const = 0;
};

}  // namespace hapticd::identification
