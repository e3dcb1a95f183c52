#pragma once

#include <string>

#include "hapticd/v1/pose.pb.h"
#include "server/pose/issued_pose.h"
#include "server/pose/tool_pose.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// A checked request.
struct WantedPoses {
  pose::PoseRequest pose;
  double rate_hz = 0.0;
};
Outcome<WantedPoses> read_request(const v1::SubscribePosesRequest& request);

/// Encodes all of a pose but what is each stream's own.
std::string encode(const pose::IssuedPose& issued);

}  // namespace hapticd::server
