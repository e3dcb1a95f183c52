#pragma once

#include <cstdint>
#include <memory>

#include "hal/error.h"
#include "server/config/console_section.h"

namespace grpc {
class Channel;
}

namespace hapticd::server {

class ConsoleDoor;
class RolePolicy;

/// Serves the page for people: its files, all calls of the service in JSON, and live streams over a socket.
/// One thread of ordinary priority; the loop notices nothing.
class ConsoleServer {
 public:
  struct Parts {
    ConsoleDoor& door;
    const RolePolicy& policy;
    std::shared_ptr<grpc::Channel> channel;  ///< to the service, within this process
    std::string certificates;                ///< folder; for listen_tls
    double loop_rate_hz = 1000.0;
  };

  /// An error when an address cannot be bound, or the certificates cannot be used.
  static hal::Result<std::unique_ptr<ConsoleServer>> start(const ConsoleConfig& config, Parts parts);
  /// Ends all calls, streams and connections.
  ~ConsoleServer();
  ConsoleServer(const ConsoleServer&) = delete;
  ConsoleServer& operator=(const ConsoleServer&) = delete;

  /// The ports in use; 0 where it does not listen.
  std::uint16_t port() const;
  std::uint16_t tls_port() const;
  /// As a browser finds it, "http://127.0.0.1:50080"; empty where it does not listen.
  std::string url() const;
  std::string tls_url() const;

 private:
  struct State;
  explicit ConsoleServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::server
