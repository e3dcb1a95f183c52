#pragma once

#include <sys/types.h>

#include <string>

namespace hapticd::bench {

/// Seconds of processor time that a process has taken so far, or its threads of one name. Throws
/// std::runtime_error if there are none.
double processor_s(pid_t pid, const std::string& thread = {});

}  // namespace hapticd::bench
