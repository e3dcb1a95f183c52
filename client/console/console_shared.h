#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "client/console/access/request_guard.h"
#include "client/console/access/request_rate.h"
#include "client/console/access/sign_in.h"
#include "client/console/daemon/daemon_monitor.h"
#include "client/console/daemon/rpc_bridge.h"
#include "client/console/daemon/stop.h"
#include "client/console/daemon/telemetry_feed.h"
#include "client/console/options.h"

namespace hapticd::console {

class SocketSession;

/// The state that all connections share. Used by the console's thread alone.
struct ConsoleShared {
  using Who = std::shared_ptr<const Session>;

  const Options options;
  const SignIn sign_in;
  RpcBridge& bridge;
  RpcBridge& stop_bridge;  ///< of stops, and of the questions whether the daemon is there
  StopPort& stop_port;
  TelemetryFeed::Post post;  ///< may be called by any thread
  const RequestGuard plain_guard;
  const RequestGuard tls_guard;
  const std::string cookie;  ///< its name: browsers keep one jar for all ports of a host
  std::string own_key;       ///< of a personal console, until it was used; empty: none
  std::shared_ptr<DaemonMonitor> watch;
  std::map<std::string, RequestRate> rates;                   ///< by identity
  std::map<std::string, std::weak_ptr<TelemetryFeed>> feeds;  ///< by identity and certificate
  std::list<std::weak_ptr<SocketSession>> sockets;
  std::size_t queued_bytes = 0;  ///< for all pages
  std::deque<std::pair<std::weak_ptr<SocketSession>, std::uint64_t>>
      due_rows{};  ///< pages and their taps, in turn
  RequestRate strangers{50.0};
  std::chrono::steady_clock::time_point last_used{};  ///< by a browser that is signed in

  bool may_ask(const Who& who);
  /// The caller for a browser at `peer`.
  Caller caller_of(const Session& who, std::string peer) const;
  std::shared_ptr<TelemetryFeed> feed_of(const Caller& caller);
  /// Pages that are open.
  std::size_t count_sockets();
  /// Makes room for one more page of this identity. If all places are taken, the oldest page of the
  /// identity that has the most gives way, so that no identity can take them all; false if no other one
  /// has more.
  bool make_place_for(const std::string& identity);
  /// Has the page whose turn it is send the rows of a tap; false if none is due.
  bool send_next_rows();
  /// Ends the page for which most is queued, if it is too much for all together.
  void limit_queued();
};

}  // namespace hapticd::console
