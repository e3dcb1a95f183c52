#pragma once

#include <string_view>

#include "hal/error.h"

namespace hapticd::netft {

/// Newtons per unit of force, by the box's name of the unit: N, kN, lbf, klbf, kgf, gf. `where` is the
/// place for the error.
hal::Result<double> newtons_per(std::string_view unit, std::string_view where);

/// Newton millimetres per unit of torque, by the box's name of the unit: Nm, Nmm, kNm, lbf-in, lbf-ft,
/// kgf-cm. Hyphens, dots and blanks are ignored, since firmware versions differ.
hal::Result<double> newton_millimetres_per(std::string_view unit, std::string_view where);

}  // namespace hapticd::netft
