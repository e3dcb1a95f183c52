#include "server/config/watchdog_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/text/text_library.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxEndpoints = 16;
constexpr Range kEndpointTimeoutMs{50.0, 60000.0, "ms"};

/// Reason why the name of an endpoint cannot be used.
std::optional<hal::Error> check_endpoint_name(const std::string& name,
                                              const std::vector<EndpointConfig>& others) {
  if (auto error = check_name("endpoint", name, "")) return error;
  const bool taken =
      std::any_of(others.begin(), others.end(), [&](const EndpointConfig& o) { return o.name == name; });
  if (!taken) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kContradiction, "two endpoints have one name", "", name,
                        "each name once", "choose another name");
}

}  // namespace

void read_watchdog(TomlTable table, WatchdogConfig& watchdog) {
  for (TomlTable& one : table.tables("endpoint", kMaxEndpoints)) {
    EndpointConfig endpoint;
    const bool named = one.wants("name");
    one.read("name", endpoint.name, 64);
    one.read("timeout_ms", endpoint.timeout_ms, kEndpointTimeoutMs);
    one.read("pedal", endpoint.pedal);
    if (const auto error = check_endpoint_name(endpoint.name, watchdog.endpoints)) {
      if (named) one.refuse("name", *error);
      if (!named)
        table.refuse("endpoint", hal::Error::of(hal::ErrorCode::kMissingKey, "an endpoint has no name", "",
                                                "", "name = …", "add it"));
    }
    watchdog.endpoints.push_back(std::move(endpoint));
  }
}

std::string write_watchdog(const WatchdogConfig& watchdog) {
  if (watchdog.endpoints.empty()) return "\n[watchdog]\nendpoint = []\n";
  std::string text;
  for (const EndpointConfig& one : watchdog.endpoints) {
    text += fmt::format("\n[[watchdog.endpoint]]\nname = {}\ntimeout_ms = {}\npedal = {}\n",
                        toml_quoted(one.name), toml_number(one.timeout_ms), one.pedal);
  }
  return text;
}

}  // namespace hapticd::server
