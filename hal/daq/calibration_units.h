#pragma once

#include <span>
#include <string_view>

namespace hapticd::daq {

/// Name of a unit in a calibration file, and its factor to our unit.
struct CalibrationUnit {
  std::string_view name;
  double factor;
};

inline constexpr double kPoundForceN = 4.4482216152605;
inline constexpr double kKilogramForceN = 9.80665;
inline constexpr double kInchMm = 25.4;
inline constexpr double kDegreeRad = 3.14159265358979323846 / 180.0;

inline constexpr CalibrationUnit kForceUnits[] = {  // N
    {"N", 1.0},
    {"kN", 1e3},
    {"lbf", kPoundForceN},
    {"lb", kPoundForceN},
    {"klbf", 1e3 * kPoundForceN},
    {"klb", 1e3 * kPoundForceN},
    {"kg", kKilogramForceN},
    {"g", 1e-3 * kKilogramForceN}};
inline constexpr CalibrationUnit kTorqueUnits[] = {  // N·mm
    {"N-mm", 1.0},
    {"Nmm", 1.0},
    {"N-m", 1e3},
    {"Nm", 1e3},
    {"kN-m", 1e6},
    {"kNm", 1e6},
    {"kg-cm", 10.0 * kKilogramForceN},
    {"kgcm", 10.0 * kKilogramForceN},
    {"lbf-in", kPoundForceN* kInchMm},
    {"in-lbf", kPoundForceN* kInchMm},
    {"lb-in", kPoundForceN* kInchMm},
    {"in-lb", kPoundForceN* kInchMm},
    {"lbf-ft", 12.0 * kPoundForceN* kInchMm},
    {"ft-lbf", 12.0 * kPoundForceN* kInchMm},
    {"lb-ft", 12.0 * kPoundForceN* kInchMm},
    {"ft-lb", 12.0 * kPoundForceN* kInchMm}};
inline constexpr CalibrationUnit kDistanceUnits[] = {  // mm
    {"mm", 1.0},
    {"cm", 10.0},
    {"m", 1e3},
    {"in", kInchMm},
    {"ft", 12.0 * kInchMm}};
inline constexpr CalibrationUnit kAngleUnits[] = {  // rad
    {"degrees", kDegreeRad}, {"degree", kDegreeRad}, {"deg", kDegreeRad},
    {"radians", 1.0},        {"radian", 1.0},        {"rad", 1.0}};

}  // namespace hapticd::daq
