#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <thread>

namespace hapticd::server {

/// A thread that always stands ready to read the network. Who waits for the events of gRPC's callback
/// interface (telemetry, health checking) sleeps for 0.1 s after every second without one (gRPC 1.51), and
/// may be the one whose turn it was to read: a command then took effect up to 0.1 s late, about once a
/// second. With one more reader, which never sleeps, someone always takes the turn over.
class StandingPoller {
 public:
  /// Before the server is built.
  explicit StandingPoller(grpc::ServerBuilder& builder) : queue_(builder.AddCompletionQueue()) {}
  /// After the server was shut down, or was never started.
  ~StandingPoller();
  StandingPoller(const StandingPoller&) = delete;
  StandingPoller& operator=(const StandingPoller&) = delete;

  /// Once the server is started.
  void start();

 private:
  void drain();

  std::unique_ptr<grpc::ServerCompletionQueue> queue_;  ///< without events of its own
  std::thread thread_;
};

}  // namespace hapticd::server
