#pragma once

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/contact/contact_stage.h"
#include "rt/contact/zero_tracker.h"
#include "rt/record/observation.h"
#include "rt/signal/tick_interval.h"
#include "rt/signal/tool_load.h"

namespace hapticd::identification {

/// Placement of an object in the rig's frame; lengths do not matter.
struct PressGeometry {
  hal::Vector3 press_direction{0.0, 0.0, -1.0};  ///< into the object
  hal::Vector3 line_direction{1.0, 0.0, 0.0};    ///< of strokes; its part along the press does not count
};

/// True if both are finite, have a length, and differ in direction by more than 10°.
bool is_usable(const PressGeometry& geometry) noexcept;

/// Turns what a live rig measures into what an identification works with: an upright tool whose sensor sits
/// straight and reads zero when free, that presses along -z and strokes along x. It allows any tool
/// orientation, any direction of the press, a sensor that is turned in the tool, and a zero that drifts
/// (followed while the tool is free, as scenes do it). A sample in, a sample out, in constant time and
/// memory.
class PressFrame {
 public:
  /// Makes a frame. `geometry`: usable. `load`: weight of the tool and seat of the sensor.
  PressFrame(const PressGeometry& geometry, const rt::ToolLoad& load, double tool_mass_g,
             const hal::RigInfo& rig);

  /// Follows the sensor's zero: once a tick, before the others.
  void follow_zero(const hal::RigSample& sample) noexcept;
  /// Positions, command and the load without the tool's weight, turned so that the press goes along -z, with
  /// the tool upright. Inertia is left in, as a sensor has it.
  rt::Observation upright(const rt::Observation& observation) const noexcept;
  /// Observation with the tool as it is held, its sensor straight and biased with the tool upright.
  rt::Observation seated(const rt::Observation& observation) const noexcept;

  rt::SensorZero zero() const noexcept { return zero_.zero(); }

 private:
  hal::Vector3 turned(const hal::Vector3& v) const noexcept { return rt::rotated(to_press_, v); }

  rt::ToolLoad load_;
  hal::Vector3 weight_n_;
  hal::Vector3 press_;
  hal::Quaternion to_press_;  ///< rig frame → press frame
  rt::ZeroTracker zero_;
  rt::TickTimer timer_;
  rt::ContactStage3 contact_;
  double contact_depth_mm_ = 0.0;
  bool has_touched_ = false;
};

}  // namespace hapticd::identification
