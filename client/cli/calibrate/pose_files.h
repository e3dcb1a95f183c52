#pragma once

#include <string>
#include <vector>

#include "hapticd/v1/calibration.pb.h"

namespace hapticd::cli {

/// Pieces to push: the tracker's poses of a CSV file with the columns stamp_ns (or stamp_s), x_mm, y_mm, z_mm
/// and, if it has orientations, qw, qx, qy, qz. Rows without a position are left out. Throws LocalError.
std::vector<v1::PushReferencePosesRequest> read_reference_file(const std::string& path);

/// Reads the rig's poses of a recording by `hapticctl telemetry record --groups sample,angles`. Throws
/// LocalError.
std::vector<v1::PushReferencePosesRequest> read_rig_file(const std::string& path);

}  // namespace hapticd::cli
