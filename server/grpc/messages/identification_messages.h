#pragma once

#include <string>

#include "hapticd/v1/identification.pb.h"
#include "server/identification/run/identification_runner.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Reads the request as the daemon's own type; refused if it names no task or an unknown enum value.
Outcome<IdentificationRequest> read_request(const v1::StartIdentificationRequest& request);

Outcome<RecordingDescription> read_description(const v1::RecordingDescription& description);

void fill(const IdentificationReport& report, v1::IdentificationProgress& message);

}  // namespace hapticd::server
