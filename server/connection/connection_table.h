#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hal/lock/mutex.h"
#include "server/access/identity.h"

namespace hapticd::server {

/// Clients behind the connections, found out once, when each was made, and kept as long as it lasts. gRPC
/// shows a call only the address of its peer, which here is the name of a relay's end: it holds the
/// connection's number, and whether its client is denied. Any thread.
class ConnectionTable {
 public:
  using Clock = std::chrono::steady_clock;

  /// Adds an identity; returns the name, which the relay gives to its end (an abstract unix socket).
  std::string add(Identity who);
  /// Closes an entry. It is kept for a while: calls that came before may still begin.
  void close(std::string_view name, Clock::time_point now);
  /// Finds a client by the peer as gRPC names it. Nothing for calls within the process and for connections
  /// that are long closed.
  std::optional<Identity> find(std::string_view peer) const;
  /// True if the peer is a relay's end, also if find() no longer knows the connection.
  static bool is_relayed(std::string_view peer);
  /// True if the client is denied, by the peer's name alone, without a lock: for a stop, which waits for
  /// nothing.
  static bool is_denied(std::string_view peer);

 private:
  static constexpr std::chrono::seconds kKept{10};
  static constexpr std::size_t kMaxClosed = 10'000;

  mutable Mutex mutex_;
  std::uint64_t last_ GUARDED_BY(mutex_) = 0;
  std::map<std::uint64_t, Identity> connections_ GUARDED_BY(mutex_);
  /// Times until which closed entries are kept.
  std::deque<std::pair<Clock::time_point, std::uint64_t>> closed_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
