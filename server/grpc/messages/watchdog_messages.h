#pragma once

#include "hapticd/v1/watchdog.pb.h"
#include "server/watchdog/endpoint_table.h"

namespace hapticd::server {

void fill(const EndpointView& view, v1::WatchdogEndpoint& message);

}  // namespace hapticd::server
