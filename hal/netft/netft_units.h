#pragma once

#include <string_view>

#include "hal/error.h"

namespace hapticd::netft {

/// Newtons in one of a unit as the box names it: N, kN, lbf, klbf, kgf, gf. `where` is the place for the
/// error.
hal::Result<double> newtons_per(std::string_view unit, std::string_view where);

/// Newton millimetres in one of a unit as the box names it: Nm, Nmm, kNm, lbf-in, lbf-ft, kgf-cm. Spellings
/// with and without a hyphen, dot or blank are the same, since firmwares differ in it.
hal::Result<double> newton_millimetres_per(std::string_view unit, std::string_view where);

}  // namespace hapticd::netft
