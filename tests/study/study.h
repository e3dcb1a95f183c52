#pragma once

#include <vector>

#include "tests/study/report/report.h"

namespace hapticd::study {

/// What a study is given. All it writes goes through the report.
struct StudyContext {
  report::Report& report;
  bool quick = false;  ///< fewer cases, the same figures: to see that everything runs
};

/// One question and the function that answers it. A part throws only when it cannot go on; what fails inside
/// is a record with the reason.
struct StudyPart {
  const char* name;
  const char* shows;
  void (*run)(StudyContext& context);
};

/// `hapticd_study NAME` runs all parts, in order.
struct Study {
  const char* name;
  const char* shows;
  std::vector<StudyPart> parts;
  /// What `--transport emulated` runs instead; empty = there is no such option.
  std::vector<StudyPart> emulated{};
};

/// All studies there are.
const std::vector<Study>& studies();

}  // namespace hapticd::study
