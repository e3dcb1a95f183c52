#pragma once

#include <string>

namespace hapticd::recording {

/// Space that is free on the disk of a folder, in 10⁶ bytes; infinite if the system does not say.
double free_disk_mb(const std::string& folder);

}  // namespace hapticd::recording
