#include "server/identification/session/kinds.h"

namespace hapticd::identification {

namespace {

using Motion = MotionRequest::Motion;

constexpr const char* kFree = "turn and wave the tool, touching nothing";

}  // namespace

const Kind& contact_kind() {
  static const Kind kind{"identification of contact dynamics", "displacement [mm]", "force [N]"};
  return kind;
}

const Kind& friction_kind() {
  static const Kind kind{
      .place = "identification of friction",
      .fit_x = "position along the line [mm]",
      .fit_y = "friction [N]",
      .remedy_of_bad_model = "check unit and column of force and position, or stroke again"};
  return kind;
}

const Kind& gains_kind() {
  static const Kind kind{"gains identification", "proportional gain", "amplitude of the oscillation [mm]"};
  return kind;
}

const Kind& inclusion_kind() {
  static const Kind kind{
      .place = "identification of an inclusion",
      .fit_x = "displacement [mm]",
      .fit_y = "normal force [N]",
      .remedy_of_bad_model = "check unit and column of force and position, or press again"};
  return kind;
}

const Kind& structural_kind() {
  static const Kind kind{"structural stiffness identification", "device force [N]", "deflection [mm]"};
  return kind;
}

const Kind& threshold_kind() {
  static const Kind kind{
      .place = "threshold identification",
      .fit_x = "greatest residual of a second [N]",
      .fit_y = "share of seconds that exceed it",
      .coverage = {{{"speed", "mm/s", 0.0, 400.0, 4},
                    {"", "", 0.0, 1.0, 0},
                    {{0, 0, "hold the tool still"},
                     {1, 0, "move the tool at 100-200 mm/s"},
                     {2, 0, "strike into the air at more than 200 mm/s"}},
                    0.3},
                   {{"turned", "°", 0.0, 40.0, 2},
                    {"", "", 0.0, 1.0, 0},
                    {{1, 0, "wave the tool while it is turned by more than 20°"}},
                    0.3}},
      .motions = {
          {.motion = Motion::kRest, .hold_s = 2.0, .words = "hold the tool still, touching nothing"},
          {.motion = Motion::kSway, .hold_s = 3.0, .speed_mm_per_s = 120.0, .tilt_deg = 40.0, .words = kFree},
          {.motion = Motion::kStrikeFree,
           .speed_mm_per_s = 220.0,
           .repetitions = 4,
           .words = "strike into the air"},
          {.motion = Motion::kSway, .hold_s = 3.0, .speed_mm_per_s = 200.0, .tilt_deg = 40.0, .words = kFree},
          {.motion = Motion::kStrikeFree,
           .speed_mm_per_s = 220.0,
           .repetitions = 4,
           .words = "strike into the air"}}};
  return kind;
}

const Kind& tool_kind() {
  static const Kind kind{
      .place = "tool identification",
      .fit_x = "force of the model [N]",
      .fit_y = "force measured, bias off [N]",
      // Orientations without which mass, bias and mounting cannot be distinguished.
      .coverage = {{{"tilt about x", "°", -75.0, 75.0, 5},
                    {"tilt about y", "°", -75.0, 75.0, 5},
                    {{2, 2, "hold the tool upright"},
                     {1, 2, "tilt the tool -30° about x"},
                     {3, 2, "tilt the tool 30° about x"},
                     {2, 1, "tilt the tool -30° about y"},
                     {2, 3, "tilt the tool 30° about y"}},
                    0.3}},
      .motions = {{.motion = Motion::kSway,
                   .hold_s = 6.0,
                   .speed_mm_per_s = 150.0,
                   .tilt_deg = 45.0,
                   .words = "turn the tool to all sides by 45° and wave it, touching nothing"}}};
  return kind;
}

}  // namespace hapticd::identification
