#pragma once

#include <string>
#include <vector>

namespace hapticd::server {

/// Sockets by which a stop comes that does not pass gRPC: bound, and closed at the end.
class StopSockets {
 public:
  /// A datagram socket beside the unix socket has its name with this ending.
  static constexpr const char* kDatagramEnding = ".stop";

  StopSockets() = default;
  StopSockets(StopSockets&& other) noexcept;
  StopSockets& operator=(StopSockets&& other) noexcept;
  ~StopSockets();

  std::vector<int> plain;  ///< on loopback; they listen
  std::vector<int> tls;    ///< for connections with certificates; they listen
  int datagram = -1;
  std::string datagram_path;  ///< removed at the end

 private:
  void close_all() noexcept;
};

}  // namespace hapticd::server
