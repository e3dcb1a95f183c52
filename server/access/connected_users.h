#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <string>

#include "server/access/role_policy.h"

namespace hapticd::server {

/// The users behind the connections within this machine. gRPC shows a call only the address of its peer: the
/// user is found out when the connection is accepted, before an address can be used again.
class ConnectedUsers {
 public:
  /// Of a connection that was just accepted. One thread.
  void note(int descriptor);
  /// By the address as gRPC names it. Unknown, with an empty name, where it was not noted.
  LocalUser find(const std::string& peer) const;

 private:
  static constexpr std::size_t kMax = 65536;
  static constexpr std::chrono::seconds kKept{60};
  LocalUser look_up(unsigned id);

  // Of the one thread that accepts.
  std::map<unsigned, LocalUser> known_;
  std::chrono::steady_clock::time_point forget_at_{};

  mutable std::mutex mutex_;
  std::map<std::string, LocalUser> users_;  ///< by the address without gRPC's escapes
  std::deque<std::string> order_;           ///< the oldest first
};

}  // namespace hapticd::server
