#pragma once

#include <optional>
#include <vector>

#include "tests/measure/study/common/study.h"

namespace hapticd::study::extremes {

/// Information of a recursive estimator, and how well its algebra holds, while nothing happens for ten hours.
struct InformationCourse {
  const char* name = "";
  std::vector<double> variance_share;       ///< largest element of its covariance over where that began
  std::vector<double> smallest_eigenvalue;  ///< of the covariance; empty if it is not reported
  std::vector<double> condition;            ///< largest over smallest magnitude of its eigenvalues
  std::vector<double> error;                ///< of the displacement or direction it gives
  double error_afterwards = 0.0;            ///< when something happened again for 20 s
};

struct Information {
  std::vector<double> time_s;
  std::vector<InformationCourse> courses;
};

/// A palpation of 20 s, ten hours of holding still, another palpation. None if shards compute it elsewhere.
std::optional<Information> information_over_time(StudyContext& context);

void show_information(StudyContext& context, const Information& information);

}  // namespace hapticd::study::extremes
