#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/error.h"

namespace hapticd::replay {

/// Which column of a recording holds what, in which unit. An empty column name means: find it by its name and
/// unit suffix ("time_s", "force_N", "indentation_mm", "position_mm").
struct ColumnMapping {
  std::string column{};
  std::string
      unit{};  ///< "s", "ms"; "N", "mN", "uN"; "mm", "um", "m"; empty = the suffix of the column's name
  double scale = 1.0;  ///< applied after the unit: how a µN recording is shown to a service that thinks in N
};

/// What a column may measure.
enum class Quantity : std::uint8_t { kTime, kForce, kPosition };

/// "time", "force" or "position".
const char* name_of(Quantity quantity) noexcept;
/// The units a mapping of this quantity may name, for messages: "s, ms, us, ns".
std::string accepted_units(Quantity quantity);

/// A mapping that was found in a header.
struct ColumnSelection {
  std::size_t index = 0;
  double factor = 1.0;  ///< cell × factor = s, N or mm
};

/// Finds the mapped column among `columns`. Refuses a name that is not there (and lists those that are), one
/// that stands there twice, an unknown or missing unit, a scale that is zero or not finite. `place` names the
/// file.
hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, Quantity quantity,
                                           const std::vector<std::string>& columns, const std::string& place);

}  // namespace hapticd::replay
