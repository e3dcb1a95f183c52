#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/demo/press_trace.h"
#include "client/cli/session/session.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {

/// One press of the demonstration: on the object as it is, or with a target.
struct DemoPress {
  std::optional<double> target_n_per_mm;  ///< none: the object as it is
  double granted_n_per_mm = 0.0;
  PressTrace trace{};
  std::optional<SettledHold> hold{};  ///< once the press is over

  /// Error of the rendered stiffness: (rendered - target) / target.
  std::optional<double> error() const;
  /// "target 0.3 N/mm", "object as it is".
  std::string name() const;
};

/// Table of target, rendered at the hand, and error, for all presses that are over.
TextTable result_table(const std::vector<DemoPress>& presses);
Json result_json(const std::vector<DemoPress>& presses);

}  // namespace hapticd::cli
