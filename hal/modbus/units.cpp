#include "hal/modbus/units.h"

#include <numbers>

namespace hapticd::modbus {

namespace {

constexpr double kDegPerTurn = 360.0;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kSecondsPerMinute = 60.0;
/// 1000 rpm in a millisecond is a million rpm in a second.
constexpr double kReciprocal = 1e6;

/// Degrees (per s, per s²) of the table per one of the unit.
double factor(Unit unit, const Gear& gear) noexcept {
  const double motor_turn = kDegPerTurn / gear.motor_turns_per_turn;
  switch (unit) {
    case Unit::kRad:
    case Unit::kRadPerS:
      return kDegPerRad;
    case Unit::kTurn:
      return kDegPerTurn;
    case Unit::kMotorTurn:
      return motor_turn;
    case Unit::kStep:
    case Unit::kStepPerS:
    case Unit::kStepPerS2:
      return motor_turn / gear.steps_per_motor_turn;
    case Unit::kMotorRpm:
    case Unit::kMotorRpmPerS:
    case Unit::kMsTo1000Rpm:
      return motor_turn / kSecondsPerMinute;
    default:
      return 1.0;
  }
}

}  // namespace

Dimension dimension_of(Unit unit) noexcept {
  switch (unit) {
    case Unit::kNone:
      return Dimension::kNone;
    case Unit::kDeg:
    case Unit::kRad:
    case Unit::kTurn:
    case Unit::kMotorTurn:
    case Unit::kStep:
      return Dimension::kAngle;
    case Unit::kDegPerS:
    case Unit::kRadPerS:
    case Unit::kMotorRpm:
    case Unit::kStepPerS:
      return Dimension::kSpeed;
    case Unit::kDegPerS2:
    case Unit::kMotorRpmPerS:
    case Unit::kStepPerS2:
    case Unit::kMsTo1000Rpm:
      return Dimension::kAcceleration;
  }
  return Dimension::kNone;
}

double to_table(double value, Unit unit, const Gear& gear) noexcept {
  const double sense = gear.reversed ? -1.0 : 1.0;
  switch (dimension_of(unit)) {
    case Dimension::kNone:
      return value;
    case Dimension::kAngle:
      return sense * value * factor(unit, gear) + gear.zero_deg;
    case Dimension::kSpeed:
      return sense * value * factor(unit, gear);
    case Dimension::kAcceleration:
      return (unit == Unit::kMsTo1000Rpm ? kReciprocal / value : value) * factor(unit, gear);
  }
  return value;
}

double to_drive(double value, Unit unit, const Gear& gear) noexcept {
  const double sense = gear.reversed ? -1.0 : 1.0;
  switch (dimension_of(unit)) {
    case Dimension::kNone:
      return value;
    case Dimension::kAngle:
      return sense * (value - gear.zero_deg) / factor(unit, gear);
    case Dimension::kSpeed:
      return value / factor(unit, gear);  // a limit: without a direction
    case Dimension::kAcceleration: {
      const double of_drive = value / factor(unit, gear);
      return unit == Unit::kMsTo1000Rpm ? kReciprocal / of_drive : of_drive;
    }
  }
  return value;
}

}  // namespace hapticd::modbus
