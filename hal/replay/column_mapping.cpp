#include "hal/replay/column_mapping.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

template <class Names>
std::string listed(const Names& names) {
  std::string text;
  for (const auto& name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

constexpr const char* kHowToMap =
    "hapticctl identify --column QUANTITY=NAME:UNIT, or hapticd --rig "
    "'replay:FILE?QUANTITY=NAME&QUANTITY_unit=UNIT'";

/// The remedy that maps a column, with the quantity filled in.
std::string how_to_map(const std::string& quantity) {
  std::string text = kHowToMap;
  constexpr std::string_view kPlace = "QUANTITY";
  for (std::size_t at = text.find(kPlace); at != std::string::npos; at = text.find(kPlace, at))
    text.replace(at, kPlace.size(), quantity);
  return text;
}

bool is_among(const std::vector<std::string>& stems, std::string_view name) {
  const std::string plain = plain_name(name);
  return std::ranges::any_of(stems, [&plain](const std::string& stem) { return plain_name(stem) == plain; });
}

/// Columns with one of these names. Without a mapped name, the unit may come from the column's name or from
/// the mapping. With `any_unit` those, too, whose unit is none of the quantity's.
std::vector<std::size_t> alike(const ColumnMapping& mapping, const ColumnRole& role,
                               const std::vector<std::string>& stems, const std::vector<std::string>& columns,
                               bool any_unit = false) {
  const bool pure = role.quantity == Quantity::kPure;
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const ColumnName name = take_apart(columns[i]);
    const bool has_unit = any_unit || !mapping.unit.empty() ||
                          (!name.unit.empty() && unit_factor(role.quantity, name.unit).has_value());
    const bool named_alike = has_unit && is_among(stems, name.stem);
    const bool bare_alike = (pure || any_unit || !mapping.unit.empty()) && is_among(stems, columns[i]);
    if (named_alike || bare_alike) hits.push_back(i);
  }
  return hits;
}

std::vector<std::size_t> recognised(const ColumnMapping& mapping, const ColumnRole& role,
                                    const std::vector<std::string>& columns) {
  std::vector<std::size_t> hits = alike(mapping, role, role.stems, columns);
  return hits.empty() ? alike(mapping, role, role.other_stems, columns) : hits;
}

std::vector<std::size_t> named(const std::string& name, const std::vector<std::string>& columns) {
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] == name) hits.push_back(i);
  }
  for (std::size_t i = 0; i < columns.size() && hits.empty(); ++i) {
    for (std::size_t j = i; j < columns.size(); ++j) {
      if (take_apart(columns[j]).stem == name) hits.push_back(j);
    }
  }
  return hits;
}

hal::Result<std::size_t> find_column(const ColumnMapping& mapping, const ColumnRole& role,
                                     const std::vector<std::string>& columns, const std::string& place) {
  const bool by_name = !mapping.column.empty();
  std::vector<std::size_t> hits =
      by_name ? named(mapping.column, columns) : recognised(mapping, role, columns);
  // One with the name alone: what is wrong is its unit, and the caller says so.
  if (hits.empty() && !by_name) hits = alike(mapping, role, role.stems, columns, true);
  if (hits.empty() && !by_name) hits = alike(mapping, role, role.other_stems, columns, true);
  if (hits.size() == 1) return hits.front();

  if (hits.empty()) {
    return hal::Error{
        .what = by_name ? "no column has that name, for the " + role.name
                        : "no column could be recognised as the " + role.name,
        .where = place,
        .value = by_name ? "'" + mapping.column + "'" : "",
        .limit = "the file's columns are " + listed(columns),
        .remedy = by_name ? "map the " + role.name + " to one of these"
                          : "map one: " + how_to_map(role.name) + "; recognised are " + listed(role.stems) +
                                " with a unit (" + accepted_units(role.quantity) + "), as in '" +
                                role.stems.front() + "_…' or '" + role.stems.front() + " [...]'",
        .code = hal::ErrorCode::kNotFound};
  }
  std::vector<std::string> names;
  names.reserve(hits.size());
  for (const std::size_t hit : hits) names.push_back(columns[hit]);
  return hal::Error{
      .what = "more than one column could be the " + role.name,
      .where = place,
      .value = listed(names),
      .limit = {},
      .remedy = by_name ? "give the columns different names" : "map one of them: " + how_to_map(role.name),
      .code = hal::ErrorCode::kContradiction};
}

}  // namespace

ColumnRole role_of(Quantity quantity) {
  ColumnRole role{name_of(quantity), quantity, {}, {}};
  switch (quantity) {
    case Quantity::kTime:
      role.stems = {"time", "t"};
      role.other_stems = {"elapsed time", "test time", "total time", "running time", "zeit", "prüfzeit"};
      break;
    case Quantity::kForce:
      role.stems = {"force", "load"};
      role.other_stems = {"f", "standard force", "kraft", "standardkraft", "prüfkraft"};
      break;
    case Quantity::kPosition:
      role.stems = {"indentation", "position", "displacement", "depth", "tip"};
      role.other_stems = {"extension",   "distance", "deformation",     "crosshead", "crosshead position",
                          "stroke",      "travel",   "standard travel", "weg",       "standardweg",
                          "traversenweg"};
      break;
    case Quantity::kTorque:
    case Quantity::kPure:
      role.stems = {role.name};
      break;
  }
  return role;
}

bool is_recognised(const ColumnRole& role, const std::vector<std::string>& columns) {
  return !recognised({}, role, columns).empty();
}

hal::Result<ColumnSelection> select_column(const ColumnMapping& mapping, const ColumnRole& role,
                                           const std::vector<std::string>& columns,
                                           const std::string& place) {
  if (!std::isfinite(mapping.scale) || mapping.scale == 0.0) {
    return hal::Error{.what = "the scale of the " + role.name + " is not valid",
                      .where = place,
                      .value = hal::number_text(mapping.scale, 9),
                      .limit = "finite and not zero; negative reverses the sign",
                      .remedy = "1 leaves the values as they are",
                      .code = hal::ErrorCode::kOutOfRange};
  }
  const auto index = find_column(mapping, role, columns, place);
  if (!index) return index.error();

  const std::string& column = columns[*index];
  // A pure number has no unit: the text after its last _ belongs to the name.
  const bool pure = role.quantity == Quantity::kPure;
  const std::string unit = mapping.unit.empty() && !pure ? take_apart(column).unit : mapping.unit;
  const auto factor = unit_factor(role.quantity, unit);
  if (!factor || (unit.empty() && !pure)) {
    const bool unstated = mapping.unit.empty();
    const std::string quantity = name_of(role.quantity);
    return hal::Error{.what = unit.empty() ? "the column's name says no unit of " + quantity
                                           : "this is not a unit of " + quantity,
                      .where = place + ", column '" + column + "'",
                      .value = unit.empty() ? std::string() : "'" + unit + "'",
                      .limit = accepted_units(role.quantity),
                      .remedy = unstated ? "say the unit: " + how_to_map(role.name)
                                         : "name one of these; a scale converts from any other unit",
                      .code = hal::ErrorCode::kUnknownWord};
  }
  return ColumnSelection{.index = *index, .factor = *factor * mapping.scale};
}

}  // namespace hapticd::replay
