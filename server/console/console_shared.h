#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "server/access/console_door.h"
#include "server/config/console_section.h"
#include "server/console/request_guard.h"
#include "server/console/request_rate.h"
#include "server/console/rpc_bridge.h"
#include "server/console/telemetry_feed.h"

namespace hapticd::server {

/// What all connections of the console share. Used by the console's thread alone.
struct ConsoleShared {
  using Session = std::shared_ptr<const ConsoleDoor::Session>;

  ConsoleConfig config;
  ConsoleDoor& door;
  const RolePolicy& policy;
  RpcBridge& bridge;
  TelemetryFeed::Post post;  ///< may be called by any thread
  double loop_rate_hz;
  RequestGuard plain_guard;
  RequestGuard tls_guard;
  std::string cookie;                        ///< its name: browsers keep one jar for all ports of a host
  std::map<std::string, RequestRate> rates;  ///< by identity
  std::map<std::string, std::weak_ptr<TelemetryFeed>> feeds;  ///< by pass
  RequestRate strangers{50.0};
  std::size_t sockets = 0;

  bool may_ask(const Session& session);
  std::shared_ptr<TelemetryFeed> feed_of(const ConsoleCaller& caller);
};

}  // namespace hapticd::server
