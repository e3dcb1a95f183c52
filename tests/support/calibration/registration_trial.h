#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hal/sim/tracker/simulated_tracker.h"
#include "server/calibration/estimate/arm_fit.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::study {

/// What a sample really was.
struct TruePose {
  calibration::RigPose reported;
  Eigen::Vector3d tip_mm;     ///< in the tracker's frame
  Eigen::Quaterniond marker;  ///< marker coordinates into the tracker's
};

/// An arm that was never calibrated, and a tracker; moved for a calibration, then otherwise.
struct RegistrationTrial {
  calibration::RigStream rig;
  std::vector<calibration::ReferencePose> reference;
  std::vector<TruePose> held_out;  ///< another motion, 100 a second
  double latency_s = 0.0;          ///< true
};

struct TrialSettings {
  std::uint64_t seed = 1;
  double calibration_s = 60.0;
  double held_out_s = 20.0;
  std::map<std::string, double> conditions{};  ///< over those of the preset "arm"
};

/// Noise 0.25 … 0.35 mm and latency 10 … 40 ms by the seed.
RegistrationTrial record_trial(const TrialSettings& settings);

struct TargetErrors {
  double median_mm = 0.0;
  double quantile_95_mm = 0.0;
  double rms_mm = 0.0;
  double predicted_rms_mm = 0.0;     ///< by the calibration's covariance, at the same poses
  double orientation_rms_rad = 0.0;  ///< of the marker
  double orientation_95_rad = 0.0;
  double predicted_orientation_rad = 0.0;
};

TargetErrors judge(const RegistrationTrial& trial, const calibration::ArmFit& fit);

}  // namespace hapticd::study
