#pragma once

#include <vector>

#include "tests/measure/report/cells.h"
#include "tests/measure/report/report.h"

namespace hapticd::study {

/// What a study is given. All it writes goes through the report.
struct StudyContext {
  report::Report& report;
  bool quick = false;          ///< fewer cases, the same figures: to see that everything runs
  const report::Cells& cells;  ///< computes what a cluster can share; the same values the one who does
};

/// What the simulated objects have to do with a part.
enum class PlantUse {
  kNone,       ///< nothing: recordings, the machine; its figures know of no plant
  kSeparable,  ///< it is about the separable family, or too dear or too live for two
  kBoth,       ///< it runs once on each family, one after the other
};

/// One question and the function that answers it. A part throws only when it cannot go on; what fails inside
/// is a record with the reason.
struct StudyPart {
  const char* name;
  const char* shows;
  void (*run)(StudyContext& context);
  PlantUse plants = PlantUse::kBoth;
  /// All its measuring is done in cells, so that shards can share it: `--shard i/n` runs such parts only, and
  /// they end if Cells::values() gives none.
  bool in_cells = false;
};

/// `hapticd_study NAME` runs all parts, in order.
struct Study {
  const char* name;
  const char* shows;
  std::vector<StudyPart> parts;
  /// What `--transport emulated` runs instead; empty = there is no such option.
  std::vector<StudyPart> emulated{};
  /// Adds a section that its page begins with, when the parts have run; null = there is none.
  void (*summarize)(StudyContext& context) = nullptr;
};

/// All studies there are.
const std::vector<Study>& studies();

}  // namespace hapticd::study
