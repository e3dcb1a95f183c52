#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/console/options.h"

namespace hapticd::console {

/// Serves the page for people: its files, all calls of the service in JSON, and live streams over a socket.
/// All of it happens in the thread of run(), but for the calls to the daemon, whose answers come from threads
/// of gRPC.
class ConsoleServer {
 public:
  /// Listens. Throws std::exception if an address cannot be bound, or the certificates cannot be used.
  explicit ConsoleServer(const Options& options);
  /// Ends all calls, streams and connections.
  ~ConsoleServer();
  ConsoleServer(const ConsoleServer&) = delete;
  ConsoleServer& operator=(const ConsoleServer&) = delete;

  /// Serves until SIGTERM or SIGINT, and, if it is personal, until its pages are gone. `ready` is called
  /// once, when it is known whether the daemon is there.
  void run(const std::function<void()>& ready);

  /// The address for a browser, "http://127.0.0.1:50080"; a personal console adds the key that opens it.
  std::string url() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::console
