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
enum class Quantity : std::uint8_t {
  kTime,
  kForce,
  kPosition,
  kTorque,  ///< factor to N·mm
  kPure,    ///< without a unit, such as the parts of a quaternion
};

/// "time", "force", "position", "torque" or "number".
const char* name_of(Quantity quantity) noexcept;
/// The units a mapping of this quantity may name, for messages: "s, ms, us, ns".
std::string accepted_units(Quantity quantity);

/// A mapping that was found in a header.
struct ColumnSelection {
  std::size_t index = 0;
  double factor = 1.0;  ///< cell × factor = s, N, mm or N·mm
};

/// A column that is looked for.
struct ColumnRole {
  std::string name;  ///< what errors call it, e.g. "force_x"
  Quantity quantity = Quantity::kPure;
  std::vector<std::string> stems;  ///< what it may be called, before its unit, where none is mapped
};

/// The one column of a one-dimensional recording that measures this quantity.
ColumnRole role_of(Quantity quantity);

/// Finds the mapped column among `columns`. Refuses a name that is not there (and lists those that are), one
/// that is there twice, an unknown or missing unit, a scale that is zero or not finite. `place` names the
/// file.
hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, const ColumnRole& role,
                                           const std::vector<std::string>& columns, const std::string& place);
inline hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, Quantity quantity,
                                                  const std::vector<std::string>& columns,
                                                  const std::string& place) {
  return select_column(mapping, role_of(quantity), columns, place);
}
/// Whether a role's column could be recognised by its name alone; for what a recording may have or not.
bool is_recognised(const ColumnRole& role, const std::vector<std::string>& columns);

}  // namespace hapticd::replay
