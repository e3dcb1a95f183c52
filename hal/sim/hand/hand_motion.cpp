#include "hal/sim/hand/hand_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/hand/hand_plan.h"

namespace hapticd::sim {

namespace {

constexpr double kTouchN = 0.05;           // of reaction: what a hand notices
constexpr double kResistanceN = 0.5;       // of anything: more than a device in free motion gives
constexpr double kServoMmPerSPerN = 20.0;  // how eagerly a hand corrects a force error
constexpr double kServoPerS = 8.0;         // and a depth error
constexpr double kFastestServoMmPerS = 60.0;
constexpr double kMaxIntentDepthMm = 80.0;
constexpr double kCatchUpPerS = 8.0;  // and a tip that lags behind a stroke
constexpr double kMaxLeadMm = 15.0;
constexpr double kYieldS = 0.06;  // how late a hand goes along with a tool that is led

}  // namespace

HandMotion::HandMotion(const HandProgram& program, const hal::Vector3& from_mm) noexcept
    : program_(program), follows_mm_(from_mm), home_mm_{0.0, 0.0, kHomeHeightMm} {
  const hal::Vector3 start_mm = from_mm - program.place_mm;
  vertical_.position_mm = start_mm.z;
  const hal::Vector3& d = program.stroke_direction;
  if (program.kind == HandProgram::Kind::kTap) {
    slant_ = std::tan(program.tap_slant_deg * std::numbers::pi / 180.0);
  }
  along_mm_ = slant_ * start_mm.z;
  aside_mm_ = {start_mm.x - d.x * along_mm_, start_mm.y - d.y * along_mm_, 0.0};
  const bool passive =
      program.kind == HandProgram::Kind::kWeight || program.kind == HandProgram::Kind::kShake;
  const double ready_mm = program.kind == HandProgram::Kind::kTap ? tap_height_mm() : kHomeHeightMm;
  constexpr double kMeanMmPerS = 40.0;
  const double path_mm =
      std::max({std::abs(ready_mm - start_mm.z), std::abs(start_mm.x - d.x * slant_ * ready_mm),
                std::abs(start_mm.y - d.y * slant_ * ready_mm)});
  const double duration_s = program.travel_s > 0.0 ? program.travel_s : std::max(0.2, path_mm / kMeanMmPerS);
  homeward_ = MinimumJerk({1.0, 0.0, 0.0}, {}, duration_s);
  if (passive) {
    enter(Phase::kFree);
  } else {
    enter(Phase::kLift, {ready_mm, 0.0, 0.0}, duration_s);
  }
}

bool HandMotion::is_over() const noexcept {
  using Kind = HandProgram::Kind;
  const bool ends = program_.kind == Kind::kRest || program_.kind == Kind::kPress ||
                    program_.kind == Kind::kStroke || program_.kind == Kind::kTap ||
                    program_.kind == Kind::kScan;
  // The tool follows the hand a little later.
  constexpr double kSettleS = 0.3;
  return ends && phase_ == Phase::kFree && phase_time_s_ >= kSettleS && homeward_.over(time_s_);
}

double HandMotion::tap_height_mm() const noexcept {
  return height_of_tap_mm(program_.speed_mm_per_s);
}

void HandMotion::enter(Phase phase, const MotionState& to, double duration_s) noexcept {
  phase_ = phase;
  phase_time_s_ = 0.0;
  path_ = duration_s > 0.0 ? MinimumJerk(vertical_, to, duration_s) : MinimumJerk();
}

void HandMotion::strike_again() noexcept {
  const double speed = program_.speed_mm_per_s;
  cycle_began_s_ = time_s_;
  enter(Phase::kStrike, {0.0, -speed, 0.0}, kStrikeShare * tap_height_mm() / speed);
}

void HandMotion::scan_next() noexcept {
  const int intervals = std::max(1, program_.repetitions - 1);
  const double to_mm = program_.stroke_length_mm * done_ / intervals;
  const double duration_s = done_ == 0 ? kScanSettleS : scan_return_s(program_);
  along_path_ = MinimumJerk({along_mm_, 0.0, 0.0}, {to_mm, 0.0, 0.0}, duration_s);
  enter(Phase::kReturn, {kScanHeightMm, 0.0, 0.0}, duration_s);
}

// The wave is distinguished from the way home: it grows out of wherever the hand is, and dies down in the
// end.
HandIntent HandMotion::posture(HandIntent intent) const noexcept {
  if (program_.kind == HandProgram::Kind::kDart) return dart(intent);
  if (program_.kind != HandProgram::Kind::kSway) return intent;
  const double ends_s = program_.hold_s >= 0.0 ? homeward_.duration_s() + program_.hold_s : HUGE_VAL;
  const double left_s = std::max(0.0, ends_s + kWaveBuildsUpS - time_s_);
  const bool ending = time_s_ > ends_s;
  MotionState grown = MinimumJerk({}, {1.0, 0.0, 0.0}, kWaveBuildsUpS)
                          .at(std::min(ending ? left_s : time_s_, kWaveBuildsUpS));
  if (ending) grown.velocity_mm_per_s = -grown.velocity_mm_per_s;
  const auto wave = [&](double hz, double& position_mm, double& velocity_mm_per_s) {
    const double rad_per_s = 2.0 * std::numbers::pi * hz;
    const double s_mm = program_.speed_mm_per_s / rad_per_s * std::sin(rad_per_s * time_s_);
    position_mm += grown.position_mm * s_mm;
    velocity_mm_per_s += grown.position_mm * program_.speed_mm_per_s * std::cos(rad_per_s * time_s_) +
                         grown.velocity_mm_per_s * s_mm;
  };
  // Not multiples of one another, so that the axes part.
  wave(program_.rate_hz, intent.position_mm.x, intent.velocity_mm_per_s.x);
  wave(1.31 * program_.rate_hz, intent.position_mm.y, intent.velocity_mm_per_s.y);
  wave(0.77 * program_.rate_hz, intent.position_mm.z, intent.velocity_mm_per_s.z);
  return intent;
}

// Speed rises and falls evenly; too short a way for the full speed is half way up and half way down.
HandIntent HandMotion::dart(HandIntent intent) const noexcept {
  const double begins_s = homeward_.duration_s();
  if (time_s_ < begins_s) return intent;
  const double period_s = 1.0 / program_.rate_hz;
  const double into_s = std::fmod(time_s_ - begins_s, period_s);
  const bool back = into_s >= 0.5 * period_s;
  // What was begun is brought back.
  if (program_.hold_s >= 0.0 && time_s_ - into_s >= begins_s + program_.hold_s) return intent;
  const double length_mm = program_.stroke_length_mm;
  const double rate_mm_per_s2 = 1e3 * program_.acceleration_m_per_s2;
  const double speed_mm_per_s = std::min(program_.speed_mm_per_s, std::sqrt(rate_mm_per_s2 * length_mm));
  const double rise_s = speed_mm_per_s / rate_mm_per_s2;
  const double takes_s = length_mm / speed_mm_per_s + rise_s;
  const double t = std::clamp(back ? into_s - 0.5 * period_s : into_s, 0.0, takes_s);
  const double left_s = takes_s - t;
  double gone_mm = speed_mm_per_s * (t - 0.5 * rise_s);
  double now_mm_per_s = speed_mm_per_s;
  if (t < rise_s) {
    gone_mm = 0.5 * rate_mm_per_s2 * t * t;
    now_mm_per_s = rate_mm_per_s2 * t;
  } else if (left_s < rise_s) {
    gone_mm = length_mm - 0.5 * rate_mm_per_s2 * left_s * left_s;
    now_mm_per_s = rate_mm_per_s2 * left_s;
  }
  intent.position_mm = intent.position_mm + program_.shake_direction * (back ? length_mm - gone_mm : gone_mm);
  intent.velocity_mm_per_s =
      intent.velocity_mm_per_s + program_.shake_direction * (back ? -now_mm_per_s : now_mm_per_s);
  return intent;
}

HandIntent HandMotion::follow(double step_s, const HandPerception& perceived) noexcept {
  HandIntent intent;
  intent.velocity_mm_per_s = (perceived.tip_mm - follows_mm_) * (1.0 / (kYieldS + step_s));
  follows_mm_ = follows_mm_ + intent.velocity_mm_per_s * step_s;
  intent.position_mm = follows_mm_;
  return intent;
}

void HandMotion::finish_repetition() noexcept {
  ++done_;
  const bool again = program_.repetitions < 0 || done_ < program_.repetitions;
  if (!again) return enter(Phase::kFree);
  program_.kind == HandProgram::Kind::kTap ? strike_again() : enter(Phase::kApproach);
}

void HandMotion::leave_phase() noexcept {
  const double speed = program_.speed_mm_per_s;
  switch (phase_) {
    case Phase::kLift:
      if (program_.kind == HandProgram::Kind::kRest || program_.kind == HandProgram::Kind::kSway ||
          program_.kind == HandProgram::Kind::kDart) {
        return enter(Phase::kFree);
      }
      if (program_.kind == HandProgram::Kind::kScan) return scan_next();
      if (program_.kind == HandProgram::Kind::kTap) return strike_again();
      return enter(Phase::kApproach);
    case Phase::kStrike: {  // through the surface, stopping soon below it
      const double depth =
          program_.kind == HandProgram::Kind::kScan ? scan_depth_mm(program_) : tap_depth_mm(speed);
      return enter(Phase::kRebound, {-depth, 0.0, 0.0}, kReboundShare * depth / speed);
    }
    case Phase::kRebound:
      if (program_.kind == HandProgram::Kind::kScan) {
        ++done_;
        if (done_ < program_.repetitions || program_.repetitions < 0) return scan_next();
        return enter(Phase::kRetreat, {kHomeHeightMm, 0.0, 0.0}, 0.3);
      }
      return enter(Phase::kReturn, {tap_height_mm(), 0.0, 0.0}, tap_return_s(tap_height_mm(), speed));
    case Phase::kReturn:
      if (program_.kind == HandProgram::Kind::kScan) {
        return enter(Phase::kStrike, {0.0, -speed, 0.0}, kStrikeShare * kScanHeightMm / speed);
      }
      return enter(Phase::kPause);
    case Phase::kRetreat:
      return program_.kind == HandProgram::Kind::kScan ? enter(Phase::kFree) : finish_repetition();
    default:
      return;
  }
}

// People correct a pressing force slowly: the intended position drifts at a speed in proportion to the force
// error.
void HandMotion::servo_force(double step_s, double wanted_n, const HandPerception& felt) noexcept {
  const double speed = std::clamp(-kServoMmPerSPerN * (wanted_n - felt.press_force_n), -kFastestServoMmPerS,
                                  kFastestServoMmPerS);
  vertical_.velocity_mm_per_s = speed;
  vertical_.position_mm = std::max(-kMaxIntentDepthMm, vertical_.position_mm + speed * step_s);
  vertical_.acceleration_mm_per_s2 = 0.0;
}

void HandMotion::servo_depth(double step_s, double wanted_mm, const HandPerception& felt) noexcept {
  const double speed =
      std::clamp(-kServoPerS * (wanted_mm + felt.tip_mm.z), -kFastestServoMmPerS, kFastestServoMmPerS);
  vertical_.velocity_mm_per_s = speed;
  vertical_.position_mm = std::max(-kMaxIntentDepthMm, vertical_.position_mm + speed * step_s);
  vertical_.acceleration_mm_per_s2 = 0.0;
}

double HandMotion::knock_n(double since_s) const noexcept {
  constexpr double kPeriodS = 2.0;
  constexpr double kDurationS = 0.02;
  const double into_s = std::fmod(since_s, kPeriodS);
  if (since_s < kPeriodS || into_s > kDurationS) return 0.0;
  return program_.knock_n * std::sin(std::numbers::pi * into_s / kDurationS);
}

HandIntent HandMotion::step(double step_s, const HandPerception& perceived) noexcept {
  if (program_.kind == HandProgram::Kind::kFollow) return follow(step_s, perceived);
  HandPerception felt = perceived;
  felt.tip_mm = felt.tip_mm - program_.place_mm;
  time_s_ += step_s;
  phase_time_s_ += step_s;
  HandIntent intent;

  switch (phase_) {
    case Phase::kLift:
    case Phase::kStrike:
    case Phase::kRebound:
    case Phase::kReturn:
    case Phase::kRetreat:
      vertical_ = path_.at(phase_time_s_);
      if (program_.kind == HandProgram::Kind::kScan && phase_ == Phase::kReturn) {
        const MotionState along = along_path_.at(phase_time_s_);
        along_mm_ = along.position_mm;
        along_mm_per_s_ = along.velocity_mm_per_s;
      }
      if (path_.over(phase_time_s_)) leave_phase();
      break;

    case Phase::kApproach: {
      constexpr double kAccelerationS = 0.1;
      const double speed = program_.approach_mm_per_s * std::min(1.0, phase_time_s_ / kAccelerationS);
      vertical_ = {vertical_.position_mm - speed * step_s, -speed, 0.0};
      const bool met = felt.reaction_n > kTouchN || felt.press_force_n > kResistanceN;
      if (met || vertical_.position_mm < -kMaxIntentDepthMm) enter(Phase::kLoad);
      break;
    }

    case Phase::kLoad: {
      const bool by_depth = program_.kind == HandProgram::Kind::kPress && program_.depth_mm > 0.0;
      const double load_s = load_s_of(program_);
      const double share = MinimumJerk({}, {1.0, 0.0, 0.0}, load_s).at(phase_time_s_).position_mm;
      by_depth ? servo_depth(step_s, share * program_.depth_mm, felt)
               : servo_force(step_s, share * program_.force_n, felt);
      if (program_.kind == HandProgram::Kind::kStroke) {
        if (phase_time_s_ > load_s + 0.5) {
          phase_ = Phase::kStroke;
          phase_time_s_ = 0.0;
          strokes_ = 0;
          stroking_s_ = 0.0;
          const double half = 0.5 * program_.stroke_length_mm;
          path_ =
              MinimumJerk({along_mm_, 0.0, 0.0}, {half, 0.0, 0.0}, 1.875 * half / program_.speed_mm_per_s);
        }
      } else if (program_.hold_s >= 0.0 && phase_time_s_ > load_s + program_.hold_s) {
        enter(Phase::kRetreat, {kHomeHeightMm, 0.0, 0.0},
              std::max(0.3, (kHomeHeightMm - vertical_.position_mm) / 40.0));
      }
      break;
    }

    case Phase::kStroke: {
      stroking_s_ += step_s;
      intent.support_n = knock_n(stroking_s_);
      servo_force(step_s, program_.force_n, felt);
      const MotionState along = path_.at(phase_time_s_);
      // Friction holds the tip back; a hand that watches it pulls the more.
      lead_mm_ += step_s * kCatchUpPerS * (along.position_mm - dot(felt.tip_mm, program_.stroke_direction));
      lead_mm_ = std::clamp(lead_mm_, -kMaxLeadMm, kMaxLeadMm);
      along_mm_ = along.position_mm + lead_mm_;
      along_mm_per_s_ = along.velocity_mm_per_s;
      if (path_.over(phase_time_s_)) {
        phase_time_s_ = 0.0;
        ++strokes_;
        const bool again = program_.repetitions < 0 || strokes_ < 2 * program_.repetitions;
        if (again) {
          const double half = 0.5 * program_.stroke_length_mm;
          const double from_mm = along.position_mm;
          path_ = MinimumJerk({from_mm, 0.0, 0.0}, {from_mm > 0.0 ? -half : half, 0.0, 0.0},
                              1.875 * program_.stroke_length_mm / program_.speed_mm_per_s);
        } else {
          along_mm_per_s_ = 0.0;
          done_ = program_.repetitions;
          enter(Phase::kRetreat, {kHomeHeightMm, 0.0, 0.0},
                std::max(0.3, (kHomeHeightMm - vertical_.position_mm) / 40.0));
        }
      }
      break;
    }

    case Phase::kPause:
      vertical_.velocity_mm_per_s = 0.0;
      vertical_.acceleration_mm_per_s2 = 0.0;
      if (time_s_ - cycle_began_s_ >= 1.0 / program_.rate_hz) finish_repetition();
      break;

    case Phase::kFree:
      vertical_.velocity_mm_per_s = 0.0;
      vertical_.acceleration_mm_per_s2 = 0.0;
      if (program_.kind == HandProgram::Kind::kWeight) {
        // Held up at first, then let down on the object over two seconds.
        constexpr double kLoweringS = 2.0;
        intent.support_n = -1e-3 * program_.mass_g * 9.807 * std::min(1.0, phase_time_s_ / kLoweringS);
        // It hangs on a cord: with nothing under it, it falls no farther.
        constexpr double kCordMm = 40.0;
        constexpr double kCordNPerMm = 1.0;
        intent.support_n += kCordNPerMm * std::max(0.0, -kCordMm - felt.tip_mm.z);
      } else if (program_.kind == HandProgram::Kind::kShake) {
        intent.motor_force_n =
            program_.shake_direction *
            (program_.force_n * std::sin(2.0 * std::numbers::pi * program_.rate_hz * time_s_));
      }
      break;
  }

  if (phase_ == Phase::kLoad || (phase_ == Phase::kFree && program_.kind == HandProgram::Kind::kWeight)) {
    intent.support_n += knock_n(phase_time_s_);
  }
  if (program_.kind == HandProgram::Kind::kTap) {
    along_mm_ = slant_ * vertical_.position_mm;
    along_mm_per_s_ = slant_ * vertical_.velocity_mm_per_s;
  }
  const bool along_surface =
      program_.kind == HandProgram::Kind::kStroke || program_.kind == HandProgram::Kind::kScan;
  intent.follows_contour = along_surface && phase_ != Phase::kLift && phase_ != Phase::kApproach;
  const hal::Vector3& d = program_.stroke_direction;
  const MotionState aside = homeward_.at(time_s_);
  intent.position_mm = {home_mm_.x + d.x * along_mm_ + aside_mm_.x * aside.position_mm,
                        home_mm_.y + d.y * along_mm_ + aside_mm_.y * aside.position_mm,
                        vertical_.position_mm};
  intent.velocity_mm_per_s = {d.x * along_mm_per_s_ + aside_mm_.x * aside.velocity_mm_per_s,
                              d.y * along_mm_per_s_ + aside_mm_.y * aside.velocity_mm_per_s,
                              vertical_.velocity_mm_per_s};
  intent = posture(intent);
  intent.position_mm = intent.position_mm + program_.place_mm;
  return intent;
}

}  // namespace hapticd::sim
