#pragma once

#include <string>

#include "server/config/access_config.h"

namespace hapticd::server {

/// Returns the configuration with the lab whose certificates have a role: if none is configured, that of the
/// daemon's own certificate. `certificates`: folder; empty: there are none.
AccessConfig with_lab(AccessConfig access, const std::string& certificates);

}  // namespace hapticd::server
