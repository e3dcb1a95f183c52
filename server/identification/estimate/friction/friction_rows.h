#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "server/identification/estimate/contact/surface_spline.h"
#include "server/identification/gate/stroke_passages.h"

namespace hapticd::identification {

/// One moment of a stroke, resolved into the surface's own directions: what friction laws are fitted to.
struct FrictionRow {
  /// State of the friction, as known before this row.
  enum class State : std::uint8_t { kGoesOn, kNothing, kForwards, kBackwards };
  State before = State::kGoesOn;
  double slide_mm = 0.0;  ///< on the surface since the row before; positive along the line
  double path_mm = 0.0;   ///< slid since the motion last turned
  double speed_mm_per_s = 0.0;
  double normal_n = 0.0;    ///< how hard the tip presses
  double friction_n = 0.0;  ///< what the object holds against motion along the line
  double along_mm = 0.0;
  double weight = 1.0;  ///< instants in it
  int passage = 0;
  int heading = 1;       ///< of the passage: +1 along the line, -1 back
  bool settled = false;  ///< the state no longer depends on the unknown beginning
};

/// Source of the normals.
enum class NormalSource : std::uint8_t {
  kScan,           ///< the profile of a surface scan
  kMeanDirection,  ///< mean direction of the reaction back and forth
  kFlat,           ///< straight up, e.g. a recording of normal and friction force
};

struct FrictionRows {
  std::vector<FrictionRow> rows;
  double share_by_scan = 0.0;  ///< of the instants; the others had their normals from the mean direction
  double outside_share = 0.0;  ///< of the instants whose normal is unknown; left out
  double min_normal_n = 0.0, max_normal_n = 0.0;
  double most_speed_mm_per_s = 0.0;
  double max_path_mm = 0.0;
};

/// Resolves passages. `source` kScan falls back on the mean direction where the scan does not reach.
/// `constant_normal_n` > 0 overrides what was recorded (kFlat only). `unseen_turn_mm`: how far the tip slides
/// back at each turn of the motion before the position shows any of it; counted with the first of the way
/// back.
FrictionRows friction_rows(const std::vector<StrokePassage>& passages, NormalSource source,
                           const SurfaceSpline* surface, double constant_normal_n,
                           double unseen_turn_mm = 0.0);

/// Slide that encoders miss at a turn: the dry friction of the motors holds them until the structure, bent
/// one way by it, is bent as far the other way. 0 if one of the two is not known.
inline double unseen_turn_mm(const hal::DeviceInfo& device) noexcept {
  const bool known = device.coulomb_friction_n > 0.0 && device.structural_stiffness_n_per_mm > 0.0;
  return known ? 2.0 * device.coulomb_friction_n / device.structural_stiffness_n_per_mm : 0.0;
}

/// Share of the friction that had built up before a row, -1 … 1; `z` if it goes on from the row before.
inline double state_before(const FrictionRow& row, double z) {
  switch (row.before) {
    case FrictionRow::State::kNothing:
      return 0.0;
    case FrictionRow::State::kForwards:
      return 1.0;
    case FrictionRow::State::kBackwards:
      return -1.0;
    case FrictionRow::State::kGoesOn:
      break;
  }
  return z;
}

/// Error that says why no law of friction can be fitted.
inline hal::Error cannot_fit_friction(const std::string& what, const std::string& value,
                                      const std::string& limit, const std::string& remedy) {
  return {what, "identification of friction", value, limit, remedy};
}

}  // namespace hapticd::identification
