#pragma once

#include <string>
#include <vector>

#include "tests/measure/report/report.h"

namespace hapticd::report {

/// What an error_vs_runtime figure gives as its source if the method is the one that ships.
inline constexpr const char* kDefaultMethod = "the default";

/// One way to do a stage's work: how wrong it is and what it takes.
struct Method {
  std::string name;
  double error = 0.0;
  double run_time_ns = 0.0;
  bool is_default = false;
  std::string failed{};  ///< why there is neither
};

/// The methods of one stage, on the same data.
struct WorkPrecision {
  std::string stage;                  ///< "velocity"; also of the names of files
  std::string error_name;             ///< "velocity error, rms of truth's"
  std::string error_unit = "1";       ///< as in Figure: "1" is a fraction
  std::string run_time_per = "tick";  ///< what the run time is of
  std::vector<Method> methods{};
  std::string remark{};         ///< data, seeds, how the error is judged
  std::string justification{};  ///< why the default is not on the front, if it is not
  bool logarithmic_error = true;
};

/// True if no other method is at least as good in error at a run time at least 10 % less, nor better in error
/// (by more than 2 %) at no more run time than 10 % above: timings on a shared machine do not decide closer
/// calls.
bool is_on_front(const WorkPrecision& stage, const Method& method);

/// Figures error_vs_runtime {stage, method}, table and plot precision_STAGE, and a sentence on the default.
/// Throws std::logic_error when there is no single default, or it is off the front and nothing justifies it:
/// a default that is beaten is to be changed or explained.
void add_work_precision(Report& report, const WorkPrecision& stage);

}  // namespace hapticd::report
