#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/object/friction.h"
#include "hal/sim/object/general_friction.h"
#include "hal/sim/object/general_material.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/phantom_body.h"
#include "hal/sim/object/shape.h"

namespace hapticd::sim {

/// What the tool ends in.
enum class Tip : std::uint8_t {
  kRod,          ///< solid aluminium rod of 3 mm: slides
  kBallBearing,  ///< ball that rolls (D§4.4.1): little friction, much the same on all objects
};

/// A real object as the simulated rig knows it. Sources are named in object_model.cpp.
struct ObjectModel {
  std::string name;
  Shape shape;
  MaterialParameters material;
  FrictionParameters friction;          ///< with the rod
  FrictionParameters friction_bearing;  ///< with the ball bearing
  /// No object is strictly homogeneous (D§4.1): its force is (1 + share · sin(2πx/λ) cos(2πy/λ)) times the
  /// material's at the surface point (x, y); where it is touched first, at the origin, it is the material's.
  double inhomogeneity_share = 0.0;
  double inhomogeneity_wavelength_mm = 40.0;

  /// What the general family has besides the above: of `material` it takes all but the branches. Sources in
  /// general_object_model.cpp.
  GeneralMaterialParameters general_material{};
  GeneralFrictionParameters general_friction{};  ///< with either tip

  /// Separate matter in place of the laws of both families; its surface rubs as theirs.
  std::optional<PhantomParameters> phantom{};

  double stiffness_scale(const hal::Vector3& surface_point_mm) const noexcept;

  const FrictionParameters& friction_with(Tip tip) const noexcept {
    return tip == Tip::kRod ? friction : friction_bearing;
  }
};

std::optional<ObjectModel> object_preset(const std::string& name);
std::vector<std::string> object_preset_names();

std::optional<Tip> tip_named(const std::string& name);
std::vector<std::string> tip_names();

}  // namespace hapticd::sim
