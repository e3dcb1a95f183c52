#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/error.h"

namespace hapticd::replay {

/// The column of a quantity in a recording, and its unit. With an empty column name, the column is found by
/// its name and unit suffix ("time_s", "force_N", "indentation_mm", "position_mm").
struct ColumnMapping {
  std::string column{};
  std::string
      unit{};  ///< "s", "ms"; "N", "mN", "uN"; "mm", "um", "m"; empty = the suffix of the column's name
  double scale = 1.0;  ///< applied after the unit, e.g. 1e3 to show mN as N
};

/// Quantity of a column.
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

/// A column that was found in a header.
struct ColumnSelection {
  std::size_t index = 0;
  double factor = 1.0;  ///< cell × factor = s, N, mm or N·mm
};

/// A column to be found.
struct ColumnRole {
  std::string name;  ///< name in errors, e.g. "force_x"
  Quantity quantity = Quantity::kPure;
  std::vector<std::string> stems;  ///< possible names, without the unit, if no column is mapped
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
/// Whether a role's column can be found by its name alone; for optional columns.
bool is_recognised(const ColumnRole& role, const std::vector<std::string>& columns);

}  // namespace hapticd::replay
