#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/units.h"

namespace hapticd::replay {

/// The column of a quantity in a recording, and its unit. With an empty column name, the column is found by
/// its name and unit ("time_s", "Force (N)", "indentation_mm").
struct ColumnMapping {
  std::string column{};  ///< its whole name, or the name without the unit
  std::string unit{};    ///< of units.h; empty = the one in the column's name
  double scale = 1.0;    ///< applied after the unit, e.g. 1e3 to show mN as N
};

/// A column that was found in a header.
struct ColumnSelection {
  std::size_t index = 0;
  double factor = 1.0;  ///< cell × factor = s, N, mm or N·mm
};

/// A column to be found.
struct ColumnRole {
  std::string name;  ///< name in errors, e.g. "force_x"
  Quantity quantity = Quantity::kPure;
  /// Possible names, without the unit, if no column is mapped. Compared as plain_name().
  std::vector<std::string> stems;
  std::vector<std::string> other_stems{};  ///< looked for if none of the stems is there
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
/// True if a role's column can be found by its name alone; for optional columns.
bool is_recognised(const ColumnRole& role, const std::vector<std::string>& columns);

}  // namespace hapticd::replay
