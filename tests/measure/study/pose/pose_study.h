#pragma once

#include <string>
#include <vector>

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// How far the instant of a contact that the detector reports is from the true one, ms; positive = late.
struct OnsetErrors {
  std::vector<double> error_ms;
  std::vector<double> noticed_ms;  ///< from the true instant to its declaration
  int outside_bounds = 0;          ///< true instants not within the reported bounds
  int missed = 0;
};

/// Taps an object in a scene of one ("tap_1d") or three dimensions ("explore_bearing").
OnsetErrors tap_for_onsets(const std::string& object, bool three_dimensions, double speed_mm_per_s, int taps);

/// Instants of contacts, noticed and reported, against the truth.
void run_contact_onset(StudyContext& context);

/// Poses predicted ahead against what came, and against none predicted.
void run_pose_prediction(StudyContext& context);

}  // namespace hapticd::study
