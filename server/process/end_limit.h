#pragma once

#include <chrono>

namespace hapticd::server {

/// Ends the process, exit code 0, if it has not ended by itself in so much time. Needs no thread: gRPC waits
/// without an end for calls whose end it wanted to give to a thread that the system did not grant.
void end_within(std::chrono::milliseconds limit);

}  // namespace hapticd::server
