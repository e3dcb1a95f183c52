#pragma once

namespace hapticd::server {

/// Of the daemon, e.g. "0.1.0".
const char* version();

}  // namespace hapticd::server
