#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hapticd::replay {

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
/// The units of this quantity, for messages: "s, ms, us, ns, min, h".
std::string accepted_units(Quantity quantity);

/// Returns the factor of a unit to s, N, mm or N·mm, and nothing if it is not a unit of the quantity. Both
/// micro signs are read as u. Capitals count only if another unit differs by them: "KN" is kN, but "MN" is
/// not mN.
std::optional<double> unit_factor(Quantity quantity, std::string_view unit);
/// Returns whether a word is a unit of time, force, position or torque.
bool is_unit(std::string_view word);

/// A column's name, taken apart.
struct ColumnName {
  std::string stem;
  std::string unit;  ///< empty if the name ends in none
};
/// Takes a header apart: "force_N", "Force (N)", "Force [N]", "Force/N", "Force, N" and "Force in N" →
/// "Force", "N". What is in brackets or behind the last '_' counts as the unit even if it is not known as
/// one.
ColumnName take_apart(std::string_view name);
/// Name for comparison: without capitals, with one blank for each '_', '-' and row of blanks.
std::string plain_name(std::string_view name);

}  // namespace hapticd::replay
