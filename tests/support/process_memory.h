#pragma once

#include <sys/types.h>

namespace hapticd::test {

/// Megabytes that a process has in memory now.
double resident_mb(pid_t process);
/// The most it ever had.
double max_resident_mb(pid_t process);

}  // namespace hapticd::test
