#pragma once

#include <string>
#include <vector>

namespace hapticd::server {

/// A program without which there is no force.
struct EndpointConfig {
  std::string name;
  double timeout_ms = 500.0;  ///< from a check-in until it is missing
  bool pedal = false;         ///< each check-in has to say whether it is pressed
};

/// The dead man: [watchdog] of the configuration. No endpoints: none.
struct WatchdogConfig {
  std::vector<EndpointConfig> endpoints;
};

}  // namespace hapticd::server
