#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "tests/measure/report/report.h"

namespace hapticd::study {

/// Share of errors that are within so many of the standard deviations that were stated for them.
class Coverage {
 public:
  void add(double error, double deviation) {
    const double ratio = deviation > 0.0 ? std::abs(error) / deviation : HUGE_VAL;
    ++count_;
    if (ratio <= 1.0) ++within_[0];
    if (ratio <= 2.0) ++within_[1];
    const double bounded = std::min(ratio, 100.0);
    squares_ += bounded * bounded;
  }
  void add(const Coverage& other) {
    count_ += other.count_;
    for (std::size_t i = 0; i < within_.size(); ++i) within_[i] += other.within_[i];
    squares_ += other.squares_;
  }

  double share(std::size_t deviations) const {
    return count_ > 0.0 ? within_.at(deviations - 1) / count_ : std::nan("");
  }
  /// Root of the mean square of error over deviation, each 100 at most: 1 if the deviations are true.
  double rms() const { return std::sqrt(squares_ / count_); }
  std::string text(double deviations) const {
    return report::fixed(100.0 * share(static_cast<std::size_t>(deviations)), 0);
  }
  /// Figures coverage_1sd and coverage_2sd of this quantity; the plant is the report's condition.
  void report(report::Report& to, const std::string& quantity) const {
    for (const std::size_t deviations : {1U, 2U}) {
      report::Figure figure{deviations == 1 ? "coverage_1sd" : "coverage_2sd", {{"quantity", quantity}}};
      figure.reference = deviations == 1 ? 0.68 : 0.95;
      figure.source = "of errors that are normal, within ± 0.10";
      if (count_ > 0.0) {
        figure.value = share(deviations);
      } else {
        figure.failed = "nothing was counted";
      }
      to.add(figure);
    }
  }

 private:
  double count_ = 0.0;
  std::array<double, 2> within_{};
  double squares_ = 0.0;
};

}  // namespace hapticd::study
