#include "tests/measure/study/modulation/transient_trial.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "rt/modulation/transient_waveform.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kBeforeS = 0.02;
constexpr double kAfterS = 0.15;

/// Residual of the best amplitude and phase, relative; the amplitude if asked for.
double residual_of(const std::vector<double>& values, double rate_hz, double frequency_hz, double decay_per_s,
                   double* amplitude) {
  const rt::SmoothMode mode = rt::smooth_mode(frequency_hz, decay_per_s);
  double cc = 0.0, cs = 0.0, ss = 0.0, vc = 0.0, vs = 0.0, vv = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    std::complex<double> z;
    for (std::size_t j = 0; j < rt::SmoothMode::kTerms; ++j) z += mode.weight[j] * std::exp(mode.pole[j] * t);
    const double c = z.real(), s = z.imag();
    cc += c * c, cs += c * s, ss += s * s;
    vc += values[i] * c, vs += values[i] * s, vv += values[i] * values[i];
  }
  const double det = cc * ss - cs * cs;
  if (!(det > 0.0) || !(vv > 0.0)) return 1.0;
  const double a = (vc * ss - vs * cs) / det, b = (vs * cc - vc * cs) / det;
  if (amplitude != nullptr) *amplitude = std::hypot(a, b);
  return std::sqrt(std::max(0.0, vv - a * vc - b * vs) / vv);
}

}  // namespace

double TapLog::onset_ms() const {
  for (std::size_t i = contact; i < transient_n.size(); ++i) {
    if (transient_n[i] != 0.0) return 1e3 * static_cast<double>(i - contact) / rate_hz;
  }
  return -1.0;
}

double TapLog::rate_hardness_n_per_mm(const std::vector<double>& force_n) const {
  const auto end = std::min(force_n.size(), contact + static_cast<std::size_t>(0.02 * rate_hz));
  double rate = 0.0;
  // Over a millisecond, what a finger may distinguish.
  const auto span = static_cast<std::size_t>(std::max(1.0, 1e-3 * rate_hz));
  for (std::size_t i = contact; i + span < end; ++i) {
    rate = std::max(rate, (force_n[i + span] - force_n[i]) * rate_hz / static_cast<double>(span));
  }
  return rate / impact_mm_per_s;
}

TapLog tap(const TransientTrial& trial) {
  sim::SimulationConfig rig = explore_rig(trial.device, trial.object, "ball_bearing");
  rig.rate_hz = trial.rate_hz;
  rig.custom_device = sim::device_preset(trial.device);
  rig.custom_device->command_latency_s = std::min(1e-3, 1.0 / trial.rate_hz);
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  scene.explore.displacement = rt::DisplacementEstimator::kRecursive;  // needs no model
  scene.explore.modulated = trial.target.has_value();
  if (trial.target) scene.target = *trial.target;
  scene.compensation.back_drive = false;
  scene.transient = trial.transient;
  VirtualRun run(rig, scene, true);
  run.set_hand(tapping(trial.speed_mm_per_s, 1));
  TapLog log;
  log.rate_hz = trial.rate_hz;
  const auto before = static_cast<std::size_t>(kBeforeS * trial.rate_hz);
  const auto after = static_cast<std::size_t>(kAfterS * trial.rate_hz);
  double z = 0.0, z_before = 0.0;
  bool touched = false;
  while (run.time_s() < 6.0 && (!touched || log.hand_n.size() < log.contact + after)) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    const double now = truth.tip_position_mm.z;
    const double a = 1e-3 * (now - 2.0 * z + z_before) * trial.rate_hz * trial.rate_hz;
    if (truth.in_contact && !touched) {
      touched = true;
      log.contact = log.hand_n.size();
      log.impact_mm_per_s = (z - now) * trial.rate_hz;
    }
    z_before = z;
    z = now;
    log.acceleration_m_per_s2.push_back(a);
    log.hand_n.push_back(-truth.hand_force_n.z);
    log.given_n.push_back(truth.reaction_force_n.z + truth.device_force_n.z);
    log.transient_n.push_back(run.record().transient_force_n);
    log.amplitude_share = std::max(log.amplitude_share, run.record().transient_share);
    if (log.estimated_mm_per_s == 0.0 && run.record().transient_force_n != 0.0) {
      log.estimated_mm_per_s = run.record().transient_impact_mm_per_s;
    }
    if (!touched && log.hand_n.size() > before) {
      for (auto* values : {&log.acceleration_m_per_s2, &log.hand_n, &log.given_n, &log.transient_n}) {
        values->erase(values->begin());
      }
    }
  }
  if (!touched) log.failed = "the tap touched nothing";
  return log;
}

DecayFit fit_decay(const std::vector<double>& values, double rate_hz, const rt::TransientMode& about) {
  DecayFit best;
  double f_span = std::log(2.0), b_low = 0.0, b_high = 4.0 * about.decay_per_s;
  double f = about.frequency_hz, b = about.decay_per_s;
  for (int pass = 0; pass < 6; ++pass) {
    constexpr int kGrid = 8;
    const double f_mid = f, b_from = b_low, b_to = b_high;
    for (int i = -kGrid; i <= kGrid; ++i) {
      for (int j = 0; j <= 2 * kGrid; ++j) {
        const double try_f = f_mid * std::exp(f_span * i / kGrid);
        const double try_b = b_from + (b_to - b_from) * j / (2.0 * kGrid);
        double amplitude = 0.0;
        const double residual = residual_of(values, rate_hz, try_f, try_b, &amplitude);
        if (residual >= best.residual) continue;
        best = {try_f, try_b, amplitude, residual};
        f = try_f;
        b = try_b;
      }
    }
    f_span /= 4.0;
    const double reach = (b_to - b_from) / 8.0;
    b_low = std::max(0.0, b - reach);
    b_high = b + reach;
  }
  return best;
}

DecayFit fit_added(const TapLog& with, const TapLog& without, const rt::TransientMode& mode) {
  // The command takes a tick to be held and one to reach the motors.
  const double from_s = 1e-3 * with.onset_ms();
  const double to_s = from_s + 0.08;
  std::vector<double> added;
  for (double t = from_s; t < to_s; t += 1.0 / with.rate_hz) {
    const auto step = static_cast<std::size_t>(std::lround(t * with.rate_hz));
    if (with.contact + step >= with.acceleration_m_per_s2.size() ||
        without.contact + step >= without.acceleration_m_per_s2.size()) {
      break;
    }
    added.push_back(with.acceleration_m_per_s2[with.contact + step] -
                    without.acceleration_m_per_s2[without.contact + step]);
  }
  return fit_decay(added, with.rate_hz, mode);
}

}  // namespace hapticd::study
