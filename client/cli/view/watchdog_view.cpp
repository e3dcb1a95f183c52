#include "client/cli/view/watchdog_view.h"

#include <fmt/core.h>

namespace hapticd::cli {

std::string endpoint_words(const v1::WatchdogEndpoint& endpoint) {
  switch (endpoint.state()) {
    case v1::ENDPOINT_STATE_AWAITED:
      return "has not checked in yet";
    case v1::ENDPOINT_STATE_ALIVE:
      return endpoint.is_pedal() ? "alive and pressed" : "alive";
    case v1::ENDPOINT_STATE_RELEASED:
      return "reports its pedal released";
    case v1::ENDPOINT_STATE_MISSING:
      return fmt::format("was not heard of for {:.1f} s", 1e-3 * endpoint.silent_ms());
    default:
      return "unknown";
  }
}

std::string watchdog_words(const WatchdogEndpoints& endpoints) {
  std::string away;
  for (const v1::WatchdogEndpoint& endpoint : endpoints) {
    if (endpoint.state() == v1::ENDPOINT_STATE_ALIVE) continue;
    away += fmt::format("{}{} {}", away.empty() ? "" : ", ", endpoint.name(), endpoint_words(endpoint));
  }
  return away.empty() ? fmt::format("all {} endpoints are alive", endpoints.size()) : "no force: " + away;
}

}  // namespace hapticd::cli
