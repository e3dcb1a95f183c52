#pragma once

#include <cstdint>
#include <optional>

namespace hapticd::modbus {

/// Unit in which a drive shows or wants a quantity. "Motor" units are before the gear, the others at the
/// table.
enum class Unit : std::uint8_t {
  kNone,
  kDeg,
  kRad,
  kTurn,
  kMotorTurn,
  kStep,
  kDegPerS,
  kRadPerS,
  kMotorRpm,
  kStepPerS,
  kDegPerS2,
  kMotorRpmPerS,
  kStepPerS2,
  kMsTo1000Rpm,  ///< time in which the motor gains 1000 rpm: the reciprocal of an acceleration
};

enum class Dimension : std::uint8_t { kNone, kAngle, kSpeed, kAcceleration };
Dimension dimension_of(Unit unit) noexcept;

/// Conversion between the drive's counts and the table.
struct Gear {
  double steps_per_motor_turn = 10000.0;
  double motor_turns_per_turn = 1.0;  ///< of the table
  bool reversed = false;              ///< the drive counts in the opposite direction
  double zero_deg = 0.0;              ///< the table's angle where the drive says 0
};

/// Converts a quantity in a drive's unit to the table: deg, deg/s or deg/s². Angles with the gear's direction
/// and zero, speeds with its direction, accelerations with neither.
double to_table(double value, Unit unit, const Gear& gear) noexcept;
/// Converts back: the inverse of to_table().
double to_drive(double value, Unit unit, const Gear& gear) noexcept;

}  // namespace hapticd::modbus
