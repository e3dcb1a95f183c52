#pragma once

#include <string>

namespace hapticd::openhaptics {

/// Why the vendor's library cannot read the devices that were set up, with the remedy; empty if it can. They
/// are in $GTDD_HOME, or in ~/.3dsystems without it. The arguments are the values of the variables, null for
/// one that is not set.
std::string config_folder_problem(const char* gtdd_home, const char* home);

}  // namespace hapticd::openhaptics
