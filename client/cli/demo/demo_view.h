#pragma once

#include <string>
#include <vector>

#include "client/cli/demo/demo_press.h"
#include "client/cli/figure/figure.h"
#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// Frame of the demonstration on the terminal while it runs: force over displacement of all presses so far,
/// the present target as a dashed line, and the results below. `state` is one line about now.
std::vector<std::string> demo_frame(const std::vector<DemoPress>& presses, const std::string& state,
                                    const Terminal& terminal);

/// Figure of the demo for a report, with rendered over target next to it.
Figure demo_figure(const std::vector<DemoPress>& presses, const std::string& title);

}  // namespace hapticd::cli
