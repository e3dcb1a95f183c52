#pragma once

#include <vector>

#include "hapticd/v1/calibration.pb.h"
#include "server/calibration/run/calibration_runner.h"

namespace hapticd::server {

Outcome<CalibrationRequest> read_request(const v1::StartCalibrationRequest& request);
Outcome<std::vector<calibration::ReferencePose>> read_poses(const v1::PushReferencePosesRequest& request);
Outcome<std::vector<calibration::RigPose>> read_rig_poses(const v1::PushReferencePosesRequest& request);
void fill(const CalibrationReport& report, v1::CalibrationProgress& message);
void fill(const StoredCalibration& calibration, bool adopted, v1::Calibration& message);

}  // namespace hapticd::server
