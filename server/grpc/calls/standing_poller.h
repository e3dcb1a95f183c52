#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <thread>

namespace hapticd::server {

/// Thread that is always ready to read the network. A thread that waits for the events of gRPC's callback
/// interface (telemetry, health checking) sleeps for 0.1 s after every second without one (gRPC 1.51), and
/// may be the one whose turn it was to read: a command then took effect up to 0.1 s late, about once a
/// second. With one more reader, which never sleeps, one thread always takes the turn over.
class StandingPoller {
 public:
  /// Adds the poller before the server is built.
  explicit StandingPoller(grpc::ServerBuilder& builder) : queue_(builder.AddCompletionQueue()) {}
  /// Ends it, after the server was shut down, or was never started.
  ~StandingPoller();
  StandingPoller(const StandingPoller&) = delete;
  StandingPoller& operator=(const StandingPoller&) = delete;

  /// Starts, once the server is started.
  void start();

 private:
  void drain();

  std::unique_ptr<grpc::ServerCompletionQueue> queue_;  ///< a queue without events
  std::thread thread_;
};

}  // namespace hapticd::server
