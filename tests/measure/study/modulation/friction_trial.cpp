#include "tests/measure/study/modulation/friction_trial.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kSettledS = 3.0;
constexpr double kSlidesMmPerS = 15.0;
constexpr double kSteadyS = 0.2;  // a reduction has come back after 0.16 s
constexpr double kTurnedS = 0.15;

/// One instant along the stroke; forces against the motion in +x.
struct Stroked {
  double time_s, path_mm, speed_mm_per_s;
  double hand_n, real_n;  ///< tangential
  double fast_n;          ///< of the device's tangential force, above 20 Hz
  double real_fast_n;     ///< and of the object's
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Path between the crossings of -half and +half of `level` by a force that turns over; negative if it does
/// not. `rises`: from - to +.
double turn_over_mm(const std::vector<Stroked>& log, std::size_t from, double level, bool rises,
                    double Stroked::*force) {
  const double sign = rises ? 1.0 : -1.0;
  double begin_mm = -1.0, end_mm = -1.0;
  bool begun = false;
  for (std::size_t i = from; i + 1 < log.size() && log[i].time_s < log[from].time_s + 0.5; ++i) {
    const double a = sign * (log[i].*force), b = sign * (log[i + 1].*force);
    const auto at = [&](double value) {
      return log[i].path_mm + (log[i + 1].path_mm - log[i].path_mm) * (value - a) / (b - a);
    };
    if (!begun && a < -0.5 * level && b >= -0.5 * level) {
      begin_mm = at(-0.5 * level);
      begun = true;
    }
    if (begun && a < 0.5 * level && b >= 0.5 * level) {
      end_mm = at(0.5 * level);
      return std::abs(end_mm - begin_mm);
    }
  }
  return -1.0;
}

}  // namespace

FrictionOutcome run_trial(const FrictionTrial& trial) {
  rt::SceneSpec scene = explore_scene(rt::Tip::kRod);
  // Motors that overcome their own friction would count as force at the hand.
  scene.compensation.back_drive = false;
  scene.friction_target = trial.target;
  scene.explore.modulated = trial.stiffness_n_per_mm.has_value();
  if (trial.stiffness_n_per_mm) scene.target = rt::linear_target(*trial.stiffness_n_per_mm);
  sim::SimulationConfig rig = explore_rig("phantom_1_5_high_force", trial.object, "rod");
  rig.rate_hz = trial.rate_hz;
  FrictionOutcome out;
  VirtualRun run(rig, scene, true, &identified(trial.object).model);
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = trial.force_n;
  hand.speed_mm_per_s = trial.speed_mm_per_s;
  hand.stroke_length_mm = trial.stroke_mm;
  hand.repetitions = -1;
  hand.approach_mm_per_s = 30.0;
  hand.force_rate_n_per_s = 4.0;
  run.set_hand(hand);

  std::vector<Stroked> log;
  rt::ButterworthLowPass slow(20.0, trial.rate_hz), slow_real(20.0, trial.rate_hz),
      slow_depth(10.0, trial.rate_hz);
  hal::Vector3 before;
  double path_mm = 0.0, hand_t = 0.0, hand_n = 0.0, real_t = 0.0, real_n = 0.0;
  double force = 0.0, depth = 0.0, swing = 0.0;
  double sliding_s = 0.0, all_hand_t = 0.0, all_real_t = 0.0;
  std::size_t sliding = 0, steady = 0;
  std::size_t contact = 0, damped = 0, bounded = 0, ticks = 0;
  while (run.time_s() < trial.seconds) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    const hal::Vector3& n = truth.outward_normal;
    const hal::Vector3 t = rt::direction_or(rt::across({1.0, 0.0, 0.0}, n), {1.0, 0.0, 0.0});
    const double step_mm = dot(truth.tip_position_mm - before, t);
    before = truth.tip_position_mm;
    const hal::Vector3 both = truth.reaction_force_n + truth.device_force_n;
    const double device_t = -dot(truth.device_force_n, t);
    const double fast = device_t - slow.update(device_t);
    const double real_t_now = -dot(truth.reaction_force_n, t);
    const double real_fast = real_t_now - slow_real.update(real_t_now);
    const double fast_depth = truth.displacement_mm - slow_depth.update(truth.displacement_mm);
    if (run.time_s() < kSettledS) continue;
    path_mm += step_mm;
    const Stroked now{run.time_s(), path_mm,  step_mm * trial.rate_hz, -dot(both, t), real_t_now,
                      fast,         real_fast};
    log.push_back(now);
    ++ticks;
    swing += fast_depth * fast_depth;
    out.slide_chatter_n += fast * fast;
    if (run.record().in_contact) ++contact;
    if (run.record().passivity_damping_n_s_per_mm > 0.0) ++damped;
    if (run.record().friction_is_bounded) ++bounded;
    out.min_energy_mj = std::min(out.min_energy_mj, run.record().hand_energy_mj);
    force -= dot(truth.hand_force_n, n);
    depth += truth.displacement_mm;
    sliding_s = std::abs(now.speed_mm_per_s) < kSlidesMmPerS ? 0.0 : sliding_s + 1.0 / trial.rate_hz;
    if (sliding_s == 0.0) continue;
    all_hand_t += std::abs(now.hand_n);
    all_real_t += std::abs(now.real_n);
    ++sliding;
    if (sliding_s < kSteadyS) continue;
    ++steady;
    const double sign = std::copysign(1.0, now.speed_mm_per_s);
    hand_t += sign * now.hand_n;
    real_t += sign * now.real_n;
    hand_n += dot(both, n);
    real_n += truth.normal_force_n;
  }
  if (contact < ticks * 9 / 10) out.failed = "contact was lost";
  out.hand_coefficient = hand_t / hand_n;
  out.real_coefficient = real_t / real_n;
  out.scale = hand_t / real_t;
  out.whole_scale = all_hand_t / all_real_t;
  out.normal_swing_mm = std::sqrt(swing / static_cast<double>(ticks));
  out.slide_chatter_n = std::sqrt(out.slide_chatter_n / static_cast<double>(ticks));
  out.stroked_n_per_mm = force / depth;
  out.damped_share = static_cast<double>(damped) / static_cast<double>(ticks);
  out.bounded_share = static_cast<double>(bounded) / static_cast<double>(ticks);

  // Level while sliding, for the crossings.
  const double count = static_cast<double>(std::max<std::size_t>(1, steady));
  const double real_level = real_t / count;
  const double hand_level = hand_t / count;
  std::vector<double> errors;
  double last_sign = 0.0;
  std::size_t last_slide = 0, turned_at = 0;
  for (std::size_t i = 0; i < log.size(); ++i) {
    if (turned_at > 0 && log[i].time_s - log[turned_at].time_s > 0.06 &&
        log[i].time_s - log[turned_at].time_s < 0.06 + kTurnedS) {
      out.chatter_n = std::max(out.chatter_n, std::abs(log[i].fast_n));
      out.real_chatter_n = std::max(out.real_chatter_n, std::abs(log[i].real_fast_n));
    }
    if (std::abs(log[i].speed_mm_per_s) < kSlidesMmPerS) continue;
    const double sign = std::copysign(1.0, log[i].speed_mm_per_s);
    if (sign * last_sign < 0.0) {
      ++out.reversals;
      turned_at = i;
      // More friction keeps the distance over which it builds up; less keeps the slope.
      const double compared = out.scale < 1.0 ? hand_level : real_level;
      const double real_mm = turn_over_mm(log, last_slide, compared, sign > 0.0, &Stroked::real_n);
      const double hand_mm = turn_over_mm(log, last_slide, hand_level, sign > 0.0, &Stroked::hand_n);
      if (real_mm > 0.0 && hand_mm > 0.0) errors.push_back(real_mm / hand_mm - 1.0);
    }
    last_sign = sign;
    last_slide = i;
  }
  out.presliding_error = median(errors);
  if (errors.empty() && out.failed.empty()) out.failed = "no reversal was seen";
  return out;
}

}  // namespace hapticd::study
