#include "hand_cycle.h"

namespace hapticd::emulators {

namespace {
constexpr double kClearOfObjectsMm = 80.0;
}

std::vector<std::string> hand_programs() {
  return {"press", "tap",  "rest", "wave",   "dart",  "follow", "palpate",
          "rub",   "turn", "free", "search", "walls", "survey"};
}

sim::HandProgram single_motion(const HandTask& task) {
  sim::HandProgram program{.force_n = task.force_n, .hold_s = task.hold_s, .repetitions = -1};
  if (task.program == "press") program.kind = sim::HandProgram::Kind::kPress;
  if (task.program == "tap") program.kind = sim::HandProgram::Kind::kTap;
  if (task.program == "follow") program.kind = sim::HandProgram::Kind::kFollow;
  if (task.program == "wave") {  // ±20 mm at 2.2 Hz, well above the object
    program.kind = sim::HandProgram::Kind::kSway;
    program.rate_hz = 2.2;
    program.speed_mm_per_s = 276.0;
    program.hold_s = -1.0;
    program.place_mm = {0.0, 0.0, 60.0};
  }
  if (task.program == "survey") {  // with the tool turned to all sides
    program.kind = sim::HandProgram::Kind::kSway;
    program.rate_hz = 0.27;
    program.speed_mm_per_s = 150.0;
    program.hold_s = -1.0;
    program.place_mm = {0.0, -25.0, 70.0};
    program.tilt_deg = 35.0;
    program.twist_deg = 35.0;
  }
  if (task.program == "dart") {  // the tool, on the spring of the hand: 400 mm/s, 20 m/s²
    program.speed_mm_per_s = 330.0;
    program.acceleration_m_per_s2 = 16.5;
    program.kind = sim::HandProgram::Kind::kDart;
    program.rate_hz = 1.0;
    program.stroke_length_mm = 60.0;
    program.hold_s = -1.0;
    program.grip_stiffness_scale = 2.0;
    program.grip_damping_scale = 4.0;
    program.place_mm = {0.0, 0.0, 20.0};
  }
  return program;
}

std::vector<sim::HandProgram> motions_in_turn(const HandTask& task) {
  using Kind = sim::HandProgram::Kind;
  constexpr double kTravelS = 1.0;
  std::vector<sim::HandProgram> cycle;
  const auto add = [&cycle](Kind kind) -> sim::HandProgram& {
    sim::HandProgram& program = cycle.emplace_back();
    program.kind = kind;
    program.travel_s = kTravelS;
    program.approach_mm_per_s = 40.0;
    return program;
  };
  if (task.program == "palpate") {
    for (const double share : {0.3, 0.65, 1.0}) {
      for (const double over_s : {1.5, 0.4, 0.1}) {
        sim::HandProgram& press = add(Kind::kPress);
        press.force_n = share * task.force_n;
        press.force_rate_n_per_s = press.force_n / over_s;
        press.hold_s = task.hold_s;
      }
      sim::HandProgram& taps = add(Kind::kTap);
      taps.speed_mm_per_s = 100.0 + 150.0 * share;
      taps.repetitions = 3;
    }
  }
  if (task.program == "rub") {
    constexpr double kLineMm = 30.0;
    constexpr double kBeyondMm = 8.0;
    for (int i = 0; i < 2; ++i) {
      sim::HandProgram& scan = add(Kind::kScan);
      scan.place_mm.x = -0.5 * kLineMm - kBeyondMm;
      scan.stroke_length_mm = kLineMm + 2.0 * kBeyondMm;
      scan.repetitions = 20;
      scan.speed_mm_per_s = 40.0;
    }
    for (const double speed_mm_per_s : {110.0, 60.0}) {
      for (const double force_n : {1.2, 3.0, 5.0}) {
        sim::HandProgram& stroke = add(Kind::kStroke);
        stroke.force_n = force_n;
        stroke.force_rate_n_per_s = 6.0;
        stroke.speed_mm_per_s = speed_mm_per_s;
        stroke.stroke_length_mm = kLineMm;
        stroke.repetitions = 4;
      }
    }
  }
  if (task.program == "turn") {
    for (const double tilt_deg : {45.0, 20.0}) {
      sim::HandProgram& sway = add(Kind::kSway);
      sway.tilt_deg = tilt_deg;
      sway.rate_hz = 1.2;
      sway.speed_mm_per_s = 150.0;
      sway.hold_s = 6.0;
      sway.place_mm.z = 80.0;
    }
  }
  if (task.program == "free") {
    add(Kind::kRest);
    for (const double speed_mm_per_s : {120.0, 200.0}) {
      sim::HandProgram& sway = add(Kind::kSway);
      sway.tilt_deg = 40.0;
      sway.rate_hz = 1.2;
      sway.speed_mm_per_s = speed_mm_per_s;
      sway.hold_s = 4.0;
      sway.place_mm.z = kClearOfObjectsMm;
      sim::HandProgram& strikes = add(Kind::kTap);
      strikes.speed_mm_per_s = 220.0;
      strikes.repetitions = 4;
      strikes.place_mm.z = kClearOfObjectsMm;
    }
  }
  if (task.program == "search") {
    sim::HandProgram& press = add(Kind::kPress);
    press.force_n = task.force_n;
    press.force_rate_n_per_s = 4.0 * task.force_n;
    press.hold_s = task.hold_s;
  }
  if (task.program == "walls") {
    // Where identify structural --constant asks for its walls; pressed from well above each.
    const hal::Vector3 places_mm[] = {
        {0.0, 0.0, 70.0}, {-80.0, 0.0, 70.0}, {80.0, 0.0, 70.0}, {0.0, 0.0, 110.0}, {0.0, -50.0, 30.0}};
    for (const hal::Vector3& place_mm : places_mm) {
      sim::HandProgram& press = add(Kind::kPress);
      press.place_mm = place_mm;
      press.force_n = task.force_n;
      press.force_rate_n_per_s = task.force_n;
      press.hold_s = 0.5;
    }
  }
  return cycle;
}

}  // namespace hapticd::emulators
