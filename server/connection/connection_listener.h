#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "server/access/identity.h"
#include "server/config/listen_address.h"
#include "server/connection/stop_sockets.h"

namespace hapticd::server {

/// Accepts the connections of the service, over TCP and a unix socket, and hands them on. gRPC's own listener
/// is not used: in gRPC 1.51, once it finds no free descriptor, it never accepts again. Of the descriptors
/// that the system allows this process, the last are kept for files. A connection that would take one of them
/// is closed at once; the next is served as soon as a descriptor is free.
class ConnectionListener {
 public:
  /// Functions that serve the connections. Called in the listener's thread.
  struct Takers {
    /// Takes over a connection's descriptor.
    std::function<void(int descriptor, ConnectionKind kind)> take;
    /// False while those of this kind that were taken over still wait to be served: the next ones stay in the
    /// kernel's queue. Each has one descriptor then and needs three to be served.
    std::function<bool(ConnectionKind kind)> has_room;
  };

  struct Endpoints {
    ListenAddress loopback;
    std::string unix_socket;  ///< empty: none. A path that exists must be free
    std::string unix_group;   ///< may open it; empty: the own group of the process
    std::optional<ListenAddress> tls;
    /// True if a user's connections over the unix socket are those of a console (kConsole). Asked in the
    /// listener's thread.
    std::function<bool(unsigned user)> is_console_user;
  };
  /// Binds and listens, on all addresses of the host; connections wait until start(). For each it binds what
  /// a stop needs as well: the next port, and a datagram socket beside the unix socket. An error names the
  /// address and the system's message.
  static hal::Result<std::unique_ptr<ConnectionListener>> open(const Endpoints& endpoints);
  /// Accepts no more; removes the unix socket.
  ~ConnectionListener();
  ConnectionListener(const ConnectionListener&) = delete;
  ConnectionListener& operator=(const ConnectionListener&) = delete;

  void start(Takers takers);
  /// Accepts no more. Connections that were handed on stay open.
  void stop();
  /// The TCP port in use.
  std::uint16_t port() const { return port_; }
  /// Port of connections with certificates; 0 if there are none.
  std::uint16_t tls_port() const { return tls_port_; }
  /// Sockets by which stops come. To be taken once.
  StopSockets take_stop_sockets() { return std::move(stop_); }
  /// Number of connections for which there are descriptors, with those that pass them on.
  std::size_t max_connections() const;
  /// Group that may open the unix socket.
  const std::string& unix_group() const { return unix_group_; }

 private:
  ConnectionListener() = default;
  struct Listening {
    int descriptor;
    ConnectionKind kind;
  };
  hal::Result<bool> open_tcp(const ListenAddress& listen, ConnectionKind kind, std::uint16_t& port);
  hal::Result<bool> try_tcp(const ListenAddress& listen, ConnectionKind kind, std::uint16_t& port);
  hal::Result<bool> open_datagram(const std::string& path);
  hal::Result<bool> open_unix(const std::string& path, const std::string& group);
  void run();
  /// Accepts some of those that wait, so that no address keeps the others waiting; returns a time after which
  /// more can be accepted.
  std::chrono::microseconds accept_some(const Listening& listening);
  /// Accepts and closes a connection for which there is no descriptor, using the reserved one.
  bool turn_away(int listening);
  void note_refused();
  /// Kind of a connection by the user at its other end.
  ConnectionKind kind_of(int descriptor, ConnectionKind listening) const;

  std::vector<Listening> listening_;
  StopSockets stop_;
  std::uint16_t port_ = 0;
  std::uint16_t tls_port_ = 0;
  std::string unix_group_;
  std::string unix_socket_;
  std::function<bool(unsigned)> is_console_user_;
  int wake_ = -1;
  int spare_ = -1;
  std::size_t max_descriptor_ = 0;  ///< a connection's number; the kernel gives the lowest that is free
  std::uint64_t refused_ = 0;
  Takers takers_;
  std::thread thread_;
};

}  // namespace hapticd::server
