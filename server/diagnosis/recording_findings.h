#pragma once

#include "server/diagnosis/finding.h"

namespace hapticd::server {

class FlightRecorder;
class Recorder;

/// Examines whether recordings and incidents are kept, where, and how much of their room is left.
Findings examine_recording(const Recorder& recorder, const FlightRecorder& flight);

}  // namespace hapticd::server
