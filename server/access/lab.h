#pragma once

#include <string>

#include "server/config/access_config.h"

namespace hapticd::server {

/// The configuration with the lab whose certificates have a role: where none is configured, that of the
/// daemon's own certificate. `certificates`: folder; empty: there are none.
AccessConfig with_lab(AccessConfig access, const std::string& certificates);

}  // namespace hapticd::server
