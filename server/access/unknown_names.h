#pragma once

#include <string>
#include <vector>

#include "server/config/access_config.h"

namespace hapticd::server {

/// Lines that warn of users and groups which [access] names and this machine does not know, and of denied
/// groups that are not the one which may open the unix socket. They are not errors: an account may be made
/// later, and a number stands for a user without a name.
std::vector<std::string> unknown_names(const AccessConfig& access);

}  // namespace hapticd::server
