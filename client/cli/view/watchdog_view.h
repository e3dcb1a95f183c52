#pragma once

#include <string>

#include "client/cpp/client.h"

namespace hapticd::cli {

/// Words on the state of one endpoint: "alive", "not heard of for 1.2 s: no force" …
std::string endpoint_words(const v1::WatchdogEndpoint& endpoint);

using WatchdogEndpoints = google::protobuf::RepeatedPtrField<v1::WatchdogEndpoint>;
/// Line on whether there may be force, and who is missing. For at least one endpoint.
std::string watchdog_words(const WatchdogEndpoints& endpoints);

}  // namespace hapticd::cli
