#pragma once

#include <string>

#include "client/cli/figure/figure.h"
#include "client/cli/plot/csv_table.h"

namespace hapticd::cli {

/// Figure of the last second before the cause of an incident: forces, the tip, what went to the device, and
/// how late sensor and loop were. `cause_s`: the rig's time of the cause, where a line is drawn.
Figure incident_figure(const CsvTable& table, const std::string& title, const std::string& cause,
                       double cause_s);

}  // namespace hapticd::cli
