#pragma once

#include <string>

#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// A bar of exactly `width` columns, `fraction` of it filled (to an eighth of a column if the terminal has
/// the signs for it). Full only at 1; NaN counts as 0, a value outside as the nearer end.
std::string progress_bar(double fraction, int width, const Terminal& terminal);

/// Fraction in whole percent, not 100 before all is done: " 63 %", "100 %".
std::string percent_done(double fraction);

}  // namespace hapticd::cli
