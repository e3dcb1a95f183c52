#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/turntable.pb.h"

namespace hapticd::cli {

/// "standing at 90.00 deg, station 'rubber'", "lost, last seen at 12.40 deg 3.2 s ago" …
std::string turntable_line(const v1::TurntableStatus& status);
/// One line with a bar, for a motion.
std::string turntable_progress(const v1::TurntableStatus& status, const Terminal& terminal);
/// All that is known, one line each.
std::vector<std::string> turntable_report(const v1::Turntable& table, const Terminal& terminal);

}  // namespace hapticd::cli
