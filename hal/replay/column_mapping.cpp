#include "hal/replay/column_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "hal/replay/number_text.h"

namespace hapticd::replay {
namespace {

struct Unit {
  std::string_view name;
  double factor;  ///< to s, N or mm
};

// "n" is newton in this project's own field names.
constexpr std::array kTimeUnits{Unit{"s", 1.0}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}, Unit{"µs", 1e-6},
                                Unit{"ns", 1e-9}};
constexpr std::array kForceUnits{Unit{"N", 1.0},   Unit{"mN", 1e-3}, Unit{"uN", 1e-6},
                                 Unit{"µN", 1e-6}, Unit{"nN", 1e-9}, Unit{"n", 1.0}};
constexpr std::array kPositionUnits{Unit{"mm", 1.0},  Unit{"um", 1e-3}, Unit{"µm", 1e-3},
                                    Unit{"nm", 1e-6}, Unit{"cm", 10.0}, Unit{"m", 1e3}};

constexpr std::array kTorqueUnits{Unit{"Nmm", 1.0}, Unit{"N·mm", 1.0}, Unit{"Nm", 1e3},
                                  Unit{"N·m", 1e3}, Unit{"mNm", 1.0},  Unit{"mN·m", 1.0}};
constexpr std::array kPureUnits{Unit{"", 1.0}, Unit{"1", 1.0}};

std::span<const Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kTime:
      return kTimeUnits;
    case Quantity::kForce:
      return kForceUnits;
    case Quantity::kTorque:
      return kTorqueUnits;
    case Quantity::kPure:
      return kPureUnits;
    case Quantity::kPosition:
      break;
  }
  return kPositionUnits;
}

const Unit* find_unit(Quantity quantity, std::string_view name) {
  const auto units = units_of(quantity);
  const auto found =
      std::find_if(units.begin(), units.end(), [name](const Unit& unit) { return unit.name == name; });
  return found == units.end() ? nullptr : &*found;
}

/// "indentation_mm" → "indentation", "mm"; a name without '_' has no unit.
std::pair<std::string_view, std::string_view> stem_and_suffix(std::string_view name) {
  const std::size_t underscore = name.rfind('_');
  if (underscore == std::string_view::npos) return {name, {}};
  return {name.substr(0, underscore), name.substr(underscore + 1)};
}

template <class Names>
std::string listed(const Names& names) {
  std::string text;
  for (const auto& name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

/// Columns with one of the role's names. Without a mapped name, the unit may come from the suffix or from
/// the mapping.
std::vector<std::size_t> alike(const ColumnMapping& mapping, const ColumnRole& role,
                               const std::vector<std::string>& columns) {
  const auto is_stem = [&role](std::string_view name) {
    return std::find(role.stems.begin(), role.stems.end(), name) != role.stems.end();
  };
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto [stem, suffix] = stem_and_suffix(columns[i]);
    const bool named_alike =
        is_stem(stem) && (find_unit(role.quantity, suffix) != nullptr || !mapping.unit.empty());
    const bool bare_alike =
        is_stem(columns[i]) && (!mapping.unit.empty() || role.quantity == Quantity::kPure);
    if (named_alike || bare_alike) hits.push_back(i);
  }
  return hits;
}

hal::Result<std::size_t> find_column(const ColumnMapping& mapping, const ColumnRole& role,
                                     const std::vector<std::string>& columns, const std::string& place) {
  const bool by_name = !mapping.column.empty();
  std::vector<std::size_t> hits;
  if (by_name) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] == mapping.column) hits.push_back(i);
    }
  } else {
    hits = alike(mapping, role, columns);
  }
  if (hits.size() == 1) return hits.front();

  if (hits.empty()) {
    return hal::Error{.what = by_name ? "no column has that name, for the " + role.name
                                      : "no column could be recognised as the " + role.name,
                      .where = place,
                      .value = by_name ? "'" + mapping.column + "'" : "",
                      .limit = "the file's columns are " + listed(columns),
                      .remedy = by_name
                                    ? "map the " + role.name + " to one of these"
                                    : "map one by name; recognised are " + listed(role.stems) +
                                          " followed by _ and a unit (" + accepted_units(role.quantity) + ")",
                      .code = hal::ErrorCode::kNotFound};
  }
  std::vector<std::string> names;
  names.reserve(hits.size());
  for (const std::size_t hit : hits) names.push_back(columns[hit]);
  return hal::Error{.what = "more than one column could be the " + role.name,
                    .where = place,
                    .value = listed(names),
                    .limit = {},
                    .remedy = by_name ? "give the columns different names" : "map one of them by name",
                    .code = hal::ErrorCode::kContradiction};
}

}  // namespace

const char* name_of(Quantity quantity) noexcept {
  switch (quantity) {
    case Quantity::kTime:
      return "time";
    case Quantity::kForce:
      return "force";
    case Quantity::kTorque:
      return "torque";
    case Quantity::kPure:
      return "number";
    case Quantity::kPosition:
      break;
  }
  return "position";
}

ColumnRole role_of(Quantity quantity) {
  ColumnRole role{name_of(quantity), quantity, {}};
  switch (quantity) {
    case Quantity::kTime:
      role.stems = {"time", "t"};
      break;
    case Quantity::kForce:
      role.stems = {"force", "load"};
      break;
    case Quantity::kPosition:
      role.stems = {"indentation", "position", "displacement", "depth", "tip"};
      break;
    case Quantity::kTorque:
    case Quantity::kPure:
      role.stems = {role.name};
      break;
  }
  return role;
}

std::string accepted_units(Quantity quantity) {
  std::vector<std::string_view> names;
  for (const Unit& unit : units_of(quantity)) {
    if (!unit.name.empty()) names.push_back(unit.name);
  }
  return listed(names);
}

bool is_recognised(const ColumnRole& role, const std::vector<std::string>& columns) {
  return !alike({}, role, columns).empty();
}

hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, const ColumnRole& role,
                                           const std::vector<std::string>& columns,
                                           const std::string& place) {
  if (!std::isfinite(mapping.scale) || mapping.scale == 0.0) {
    return hal::Error{.what = "the scale of the " + role.name + " is not valid",
                      .where = place,
                      .value = number_text(mapping.scale),
                      .limit = "finite and not zero; negative reverses the sign",
                      .remedy = {},
                      .code = hal::ErrorCode::kOutOfRange};
  }
  const auto index = find_column(mapping, role, columns, place);
  if (!index) return index.error();

  const std::string& column = columns[*index];
  // A pure number has no unit: the text after its last _ belongs to the name.
  const bool pure = role.quantity == Quantity::kPure;
  const std::string unit_name =
      mapping.unit.empty() && !pure ? std::string(stem_and_suffix(column).second) : mapping.unit;
  const Unit* unit = find_unit(role.quantity, unit_name);
  if (unit == nullptr) {
    const bool unstated = mapping.unit.empty();
    const std::string quantity = name_of(role.quantity);
    return hal::Error{.what = unstated ? "the column's name does not end in a unit of " + quantity
                                       : "this is not a unit of " + quantity,
                      .where = place + ", column '" + column + "'",
                      .value = unit_name.empty() ? std::string() : "'" + unit_name + "'",
                      .limit = accepted_units(role.quantity),
                      .remedy = unstated ? "name the unit in the mapping" : "",
                      .code = hal::ErrorCode::kUnknownWord};
  }
  return ColumnSelection{.index = *index, .factor = unit->factor * mapping.scale};
}

}  // namespace hapticd::replay
