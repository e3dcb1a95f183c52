#pragma once

#include <string>

namespace hapticd::rt {

/// Keeps the calling thread, and every thread it will start, off the CPU the loop is pinned to, so that
/// calls, telemetry and identification never hold it. Nothing if the loop is not pinned (-1) or there is no
/// other CPU. Returns why it did not work; empty if it did.
std::string leave_to_the_loop(int cpu);

}  // namespace hapticd::rt
