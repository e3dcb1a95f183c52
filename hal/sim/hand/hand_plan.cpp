#include "hal/sim/hand/hand_plan.h"

#include <algorithm>
#include <cmath>

#include "hal/sim/hand/hand_motion.h"

namespace hapticd::sim {

double planned_duration_s(const HandProgram& p) {
  const double home_s = p.travel_s > 0.0 ? p.travel_s : 2.5;  // from 100 mm away, at leisure
  const bool by_force =
      p.kind == HandProgram::Kind::kStroke || (p.kind == HandProgram::Kind::kPress && p.depth_mm <= 0.0);
  // How far a hand leans into what it presses: its own spring and the object.
  const double leaned_mm =
      by_force ? p.force_n / impedance_of(p).stiffness_n_per_mm + 20.0 : p.depth_mm + 5.0;
  const double reach_s = kHomeHeightMm / p.approach_mm_per_s + 0.3;
  const double retreat_s = std::max(0.3, (kHomeHeightMm + leaned_mm) / 40.0);
  constexpr double kFreeAgainS = 0.3;
  if (p.repetitions < 0 && p.kind != HandProgram::Kind::kRest) return HUGE_VAL;
  switch (p.kind) {
    case HandProgram::Kind::kPress:
      if (p.hold_s < 0.0) return HUGE_VAL;
      return home_s + p.repetitions * (reach_s + load_s_of(p) + p.hold_s + retreat_s) + kFreeAgainS;
    case HandProgram::Kind::kStroke:
      return home_s + reach_s + load_s_of(p) + 0.5 +
             (2.0 * p.repetitions - 0.5) * kMeanPerPeak * p.stroke_length_mm / p.speed_mm_per_s + retreat_s +
             kFreeAgainS;
    case HandProgram::Kind::kTap: {
      const double height_mm = height_of_tap_mm(p.speed_mm_per_s);
      const double once_s =
          (kStrikeShare * height_mm + kReboundShare * tap_depth_mm(p.speed_mm_per_s)) / p.speed_mm_per_s +
          tap_return_s(height_mm, p.speed_mm_per_s);
      return home_s + p.repetitions * std::max(once_s, 1.0 / p.rate_hz) + kFreeAgainS;
    }
    case HandProgram::Kind::kScan: {
      const double once_s =
          (kStrikeShare * kScanHeightMm + kReboundShare * scan_depth_mm(p)) / p.speed_mm_per_s +
          scan_return_s(p);
      return home_s + kScanSettleS + p.repetitions * once_s + retreat_s + kFreeAgainS;
    }
    case HandProgram::Kind::kRest:
    case HandProgram::Kind::kWeight:
    case HandProgram::Kind::kShake:
      return home_s;
    case HandProgram::Kind::kFollow:
      return HUGE_VAL;
    case HandProgram::Kind::kSway:
    case HandProgram::Kind::kDart:
      return p.hold_s < 0.0 ? HUGE_VAL : home_s + p.hold_s + kWaveBuildsUpS + kFreeAgainS;
  }
  return home_s;
}

// Hand: mass, spring and damper of a pinch grip on a stylus, within the spread of published identifications
// (20-100 g, 0.3-0.8 N/mm, 2-6 N·s/m). Weight: nothing but mass along the press direction, a light guide
// across it.
HandImpedance impedance_of(const HandProgram& program) {
  switch (program.kind) {
    case HandProgram::Kind::kWeight:
      return {1e-3 * program.mass_g, 0.0, 0.0, 0.2, 2e-3};
    case HandProgram::Kind::kShake:
      return {0.0, 0.02, 2e-4, 0.02, 2e-4};
    default: {
      const double stiffness = 0.5 * program.grip_stiffness_scale;
      const double damping = 4e-3 * program.grip_damping_scale;
      return {0.040, stiffness, damping, stiffness, damping};
    }
  }
}

}  // namespace hapticd::sim
