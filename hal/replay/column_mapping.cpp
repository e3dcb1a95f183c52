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

// "n" is how this project's own field names spell newton.
constexpr std::array kTimeUnits{Unit{"s", 1.0}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}, Unit{"µs", 1e-6},
                                Unit{"ns", 1e-9}};
constexpr std::array kForceUnits{Unit{"N", 1.0},   Unit{"mN", 1e-3}, Unit{"uN", 1e-6},
                                 Unit{"µN", 1e-6}, Unit{"nN", 1e-9}, Unit{"n", 1.0}};
constexpr std::array kPositionUnits{Unit{"mm", 1.0},  Unit{"um", 1e-3}, Unit{"µm", 1e-3},
                                    Unit{"nm", 1e-6}, Unit{"cm", 10.0}, Unit{"m", 1e3}};

constexpr std::array<std::string_view, 2> kTimeStems{"time", "t"};
constexpr std::array<std::string_view, 2> kForceStems{"force", "load"};
constexpr std::array<std::string_view, 5> kPositionStems{"indentation", "position", "displacement", "depth",
                                                         "tip"};

std::span<const Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kTime:
      return kTimeUnits;
    case Quantity::kForce:
      return kForceUnits;
    case Quantity::kPosition:
      break;
  }
  return kPositionUnits;
}

std::span<const std::string_view> stems_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kTime:
      return kTimeStems;
    case Quantity::kForce:
      return kForceStems;
    case Quantity::kPosition:
      break;
  }
  return kPositionStems;
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

std::string stems_text(Quantity quantity) {
  return listed(stems_of(quantity));
}

hal::Result<std::size_t> find_column(const ColumnMapping& mapping, Quantity quantity,
                                     const std::vector<std::string>& columns, const std::string& place) {
  const bool by_name = !mapping.column.empty();
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto [stem, suffix] = stem_and_suffix(columns[i]);
    const auto stems = stems_of(quantity);
    // Without a name, the unit may come from the suffix or from the mapping.
    const bool named_alike = std::find(stems.begin(), stems.end(), stem) != stems.end() &&
                             (find_unit(quantity, suffix) != nullptr || !mapping.unit.empty());
    const bool bare_alike =
        !mapping.unit.empty() && std::find(stems.begin(), stems.end(), columns[i]) != stems.end();
    if (by_name ? columns[i] == mapping.column : (named_alike || bare_alike)) hits.push_back(i);
  }
  if (hits.size() == 1) return hits.front();

  const std::string quantity_name = name_of(quantity);
  if (hits.empty()) {
    return hal::Error{.what = by_name ? "there is no column of that name for the " + quantity_name
                                      : "no column could be recognised as the " + quantity_name,
                      .where = place,
                      .value = by_name ? "'" + mapping.column + "'" : "",
                      .limit = "the file's columns are " + listed(columns),
                      .remedy = by_name ? "map the " + quantity_name + " to one of these"
                                        : "map one by name; recognised are " + stems_text(quantity) +
                                              " followed by _ and a unit (" + accepted_units(quantity) + ")"};
  }
  std::vector<std::string> names;
  names.reserve(hits.size());
  for (const std::size_t hit : hits) names.push_back(columns[hit]);
  return hal::Error{.what = "more than one column could be the " + quantity_name,
                    .where = place,
                    .value = listed(names),
                    .limit = {},
                    .remedy = by_name ? "give the columns different names" : "map one of them by name"};
}

}  // namespace

const char* name_of(Quantity quantity) noexcept {
  switch (quantity) {
    case Quantity::kTime:
      return "time";
    case Quantity::kForce:
      return "force";
    case Quantity::kPosition:
      break;
  }
  return "position";
}

std::string accepted_units(Quantity quantity) {
  std::vector<std::string_view> names;
  for (const Unit& unit : units_of(quantity)) names.push_back(unit.name);
  return listed(names);
}

hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, Quantity quantity,
                                           const std::vector<std::string>& columns,
                                           const std::string& place) {
  if (!std::isfinite(mapping.scale) || mapping.scale == 0.0) {
    return hal::Error{.what = std::string("the scale of the ") + name_of(quantity) + " is of no use",
                      .where = place,
                      .value = number_text(mapping.scale),
                      .limit = "finite and not zero; negative turns the sign",
                      .remedy = {}};
  }
  const auto index = find_column(mapping, quantity, columns, place);
  if (!index) return index.error();

  const std::string& column = columns[*index];
  const std::string unit_name =
      mapping.unit.empty() ? std::string(stem_and_suffix(column).second) : mapping.unit;
  const Unit* unit = find_unit(quantity, unit_name);
  if (unit == nullptr) {
    const bool unstated = mapping.unit.empty();
    return hal::Error{
        .what = unstated ? "the column's name does not end in a unit of " + std::string(name_of(quantity))
                         : "this is not a unit of " + std::string(name_of(quantity)),
        .where = place + ", column '" + column + "'",
        .value = unit_name.empty() ? std::string() : "'" + unit_name + "'",
        .limit = accepted_units(quantity),
        .remedy = unstated ? "name the unit in the mapping" : ""};
  }
  return ColumnSelection{.index = *index, .factor = unit->factor * mapping.scale};
}

}  // namespace hapticd::replay
