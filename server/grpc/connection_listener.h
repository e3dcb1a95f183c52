#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "server/config/listen_address.h"

namespace hapticd::server {

/// Accepts the connections of the service, over TCP and a unix socket, and hands them on. gRPC's own listener
/// is not used: in gRPC 1.51, once it finds no free descriptor, it never accepts again. Of the descriptors
/// that the system allows this process, the last are kept for files. A connection that would take one of them
/// is closed at once; the next is served as soon as a descriptor is free.
class ConnectionListener {
 public:
  /// Takes over a connection's descriptor. Called in the listener's thread.
  using Take = std::function<void(int descriptor)>;

  /// Binds and listens, on all addresses of the host; connections wait until start(). An error names the
  /// address and the system's message. An empty path: no unix socket. A path that exists must be free.
  static hal::Result<std::unique_ptr<ConnectionListener>> open(const ListenAddress& listen,
                                                               const std::string& unix_socket = {});
  /// Accepts no more; removes the unix socket.
  ~ConnectionListener();
  ConnectionListener(const ConnectionListener&) = delete;
  ConnectionListener& operator=(const ConnectionListener&) = delete;

  void start(Take take);
  /// Accepts no more. Connections that were handed on stay open.
  void stop();
  /// The TCP port in use.
  std::uint16_t port() const { return port_; }

 private:
  ConnectionListener() = default;
  hal::Result<bool> open_tcp(const ListenAddress& listen);
  hal::Result<bool> open_unix(const std::string& path);
  void run();
  void accept_all(int listening);
  /// Accepts and closes a connection for which there is no descriptor, using the reserved one.
  bool turn_away(int listening);
  void note_refused();

  std::vector<int> listening_;
  std::uint16_t port_ = 0;
  std::string unix_socket_;
  int wake_ = -1;
  int spare_ = -1;
  std::size_t max_descriptor_ = 0;  ///< a connection's number; the kernel gives the lowest that is free
  std::uint64_t refused_ = 0;
  Take take_;
  std::thread thread_;
};

}  // namespace hapticd::server
