#pragma once

#include "client/cli/figure/figure.h"
#include "client/cli/plot/csv_table.h"

namespace hapticd::cli {

/// Figure of a recording of telemetry: force over displacement while something is touched, and forces,
/// displacements and the target over time. Estimates are drawn over the estimated displacement, the truth of
/// a simulated rig over the true one; if the two differ a note says by how much and why. Throws LocalError
/// when the recording has nothing to draw.
Figure recording_figure(const CsvTable& table);

}  // namespace hapticd::cli
