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

/// Who is behind each connection, found out once, when it was made, and kept as long as it lasts. gRPC shows
/// a call only the address of its peer, which here is the name of a relay's end: it holds the connection's
/// number, and whether its client is denied. Any thread.
class ConnectionTable {
 public:
  using Clock = std::chrono::steady_clock;

  /// The name, which the relay gives to its end (an abstract unix socket).
  std::string add(Identity who);
  /// It is closed. Kept for a while: calls that came before may still begin.
  void close(std::string_view name, Clock::time_point now);
  /// By the peer as gRPC names it. Nothing for calls within the process and for connections that are long
  /// closed.
  std::optional<Identity> find(std::string_view peer) const;
  /// Whether the peer is a relay's end, also where find() no longer knows the connection.
  static bool is_relayed(std::string_view peer);
  /// By the peer's name alone, without a lock: for a stop, which waits for nothing.
  static bool is_denied(std::string_view peer);

 private:
  static constexpr std::chrono::seconds kKept{10};
  static constexpr std::size_t kMaxClosed = 10'000;

  mutable Mutex mutex_;
  std::uint64_t last_ GUARDED_BY(mutex_) = 0;
  std::map<std::uint64_t, Identity> connections_ GUARDED_BY(mutex_);
  /// Until when they are kept.
  std::deque<std::pair<Clock::time_point, std::uint64_t>> closed_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
