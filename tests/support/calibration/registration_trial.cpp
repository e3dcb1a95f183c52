#include "tests/support/calibration/registration_trial.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hal/sim/base/random.h"
#include "hal/sim/simulated_rig.h"

namespace hapticd::study {

namespace {

using calibration::RigPose;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond eigen(const hal::Quaternion& q) {
  return Quaterniond(q.w, q.x, q.y, q.z).normalized();
}
Vector3d eigen(const hal::Vector3& v) {
  return {v.x, v.y, v.z};
}

RigPose pose_of(const hal::RigSample& sample) {
  return {1e-9 * static_cast<double>(sample.time_ns), sample.angles, eigen(sample.tip_position_mm),
          eigen(sample.tip_orientation)};
}

sim::HandProgram waves(double speed_mm_per_s, double rate_hz, hal::Vector3 place_mm, double tilt_deg,
                       double twist_deg) {
  return {.kind = sim::HandProgram::Kind::kSway,
          .speed_mm_per_s = speed_mm_per_s,
          .rate_hz = rate_hz,
          .hold_s = -1.0,
          .place_mm = place_mm,
          .tilt_deg = tilt_deg,
          .twist_deg = twist_deg};
}

void begin(sim::SimulatedRig& rig, const sim::HandProgram& program) {
  if (auto error = rig.set_program(program)) throw std::runtime_error(error->text());
}

}  // namespace

RegistrationTrial record_trial(const TrialSettings& settings) {
  sim::Random random(settings.seed * 7919);
  RegistrationTrial trial;
  trial.latency_s = 0.010 + 0.030 * random.uniform();
  sim::SimulationConfig config{.object = "none", .seed = settings.seed, .conditions = "arm"};
  config.external_instrument = false;
  config.condition_values = {{"tracker_latency_ms", 1e3 * trial.latency_s},
                             {"tracker_noise_mm", 0.25 + 0.1 * random.uniform()}};
  for (const auto& [name, value] : settings.conditions) config.condition_values[name] = value;
  auto made = sim::SimulatedRig::create(config);
  if (!made) throw std::runtime_error(made.error().text());
  sim::SimulatedRig& rig = **made;

  hal::RigSample sample;
  const auto run = [&](double seconds, int stride, auto&& each) {
    const auto ticks = static_cast<int>(std::lround(seconds * config.rate_hz));
    for (int i = 0; i < ticks; ++i) {
      rig.read(sample);
      rig.write({});
      if (i % stride == 0) each();
    }
  };
  const auto take = [&](bool keep) {
    sim::TrackerPose seen;
    while (rig.tracker().take(seen)) {
      if (!keep) continue;
      calibration::ReferencePose pose{.stamp_s = 1e-9 * static_cast<double>(seen.stamp_ns),
                                      .position_mm = eigen(seen.position_mm)};
      if (seen.has_orientation) pose.orientation = eigen(seen.orientation);
      trial.reference.push_back(pose);
    }
  };
  // Within reach of the arm. Slow and wide, then quicker at another place: as one is told to move.
  begin(rig, waves(140.0, 0.25, {0.0, -20.0, 70.0}, 30.0, 35.0));
  run(2.0, 4, [&] {
    trial.rig.add(pose_of(sample));
    take(false);
  });
  const auto record = [&] {
    trial.rig.add(pose_of(sample));
    take(true);
  };
  run(0.5 * settings.calibration_s, 4, record);
  begin(rig, waves(220.0, 0.43, {25.0, -40.0, 80.0}, 40.0, 30.0));
  run(0.5 * settings.calibration_s, 4, record);
  run(0.3, 4, [&] {
    trial.rig.add(pose_of(sample));
    take(false);
  });

  const sim::TrackerTruth& truth = rig.tracker().truth();
  const Quaterniond turn = eigen(truth.tracker_from_rig);
  begin(rig, waves(120.0, 0.21, {-10.0, -25.0, 72.0}, 35.0, 30.0));
  run(2.0, 10, [] {});
  run(settings.held_out_s, 10, [&] {
    take(false);
    hal::TruthSample real;
    rig.truth(real);
    trial.held_out.push_back({pose_of(sample),
                              turn * eigen(real.tip_position_mm) + eigen(truth.tracker_from_rig_mm),
                              turn * eigen(rig.true_orientation()) * eigen(truth.tool_from_marker)});
  });
  return trial;
}

TargetErrors judge(const RegistrationTrial& trial, const calibration::ArmFit& fit) {
  std::vector<double> errors;
  std::vector<double> turns;
  TargetErrors judged;
  for (const TruePose& pose : trial.held_out) {
    const hal::RigSample sample = sample_of(pose.reported);
    const auto seen =
        in_frame(fit.calibration, correct(fit.calibration, sample), calibration::Frame::kReference);
    errors.push_back((seen.tip_mm - pose.tip_mm).norm());
    const Quaterniond marker = seen.orientation * fit.tool_from_marker.rotation;
    turns.push_back(rt::turn_of(marker.conjugate() * pose.marker).norm());
    judged.rms_mm += errors.back() * errors.back();
    judged.orientation_rms_rad += turns.back() * turns.back();
    judged.predicted_rms_mm += position_covariance_mm2(fit.calibration, sample).trace();
    judged.predicted_orientation_rad += std::pow(orientation_sd_rad(fit.calibration, sample), 2);
  }
  const auto n = static_cast<double>(errors.size());
  for (double* sum : {&judged.rms_mm, &judged.orientation_rms_rad, &judged.predicted_rms_mm,
                      &judged.predicted_orientation_rad}) {
    *sum = std::sqrt(*sum / n);
  }
  std::sort(errors.begin(), errors.end());
  std::sort(turns.begin(), turns.end());
  judged.median_mm = errors[errors.size() / 2];
  judged.quantile_95_mm = errors[static_cast<std::size_t>(0.95 * n)];
  judged.orientation_95_rad = turns[static_cast<std::size_t>(0.95 * n)];
  return judged;
}

}  // namespace hapticd::study
