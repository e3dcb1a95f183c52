#pragma once

namespace hapticd::server {

/// Version of the daemon, e.g. "0.1.0".
const char* version();

}  // namespace hapticd::server
