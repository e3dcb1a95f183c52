#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "hal/error.h"
#include "server/connection/stop_sockets.h"
#include "server/connection/tls_server.h"
#include "server/stop/stop_report.h"
#include "server/stop/stop_rights.h"

namespace hapticd::server {

class StopListener;

/// Stops without gRPC: by SIGUSR1, by a datagram beside the unix socket, and by the port next to each port of
/// the service. One thread serves what comes from this machine and takes neither memory nor a lock for it;
/// one serves connections with certificates; both run ahead of all ordinary threads, if the system allows it.
/// A third one writes the log.
class StopServer {
 public:
  struct Parts {
    StopSockets sockets;
    std::string certificates{};  ///< folder; empty: none
    StopRights rights;
    /// Takes the force away, and returns the last completed tick. Must not block.
    std::function<std::uint64_t()> stop;
    /// May wait: called on a separate thread. At most some 20 a second of those that were granted, and of
    /// those that were refused; `unreported`: others of the same kind since the last.
    std::function<void(const StopReport&, std::uint64_t unreported)> report;
  };

  /// Starts; serves when it returns. An error if no descriptors are left, or the certificates cannot be used.
  static hal::Result<std::unique_ptr<StopServer>> start(Parts parts);
  ~StopServer();
  StopServer(const StopServer&) = delete;
  StopServer& operator=(const StopServer&) = delete;

 private:
  explicit StopServer(Parts parts);
  void run_reports();

  Parts parts_;
  std::unique_ptr<TlsServer> tls_;
  int signals_ = -1;
  int arrived_ = -1;  ///< an event for each report
  std::unique_ptr<StopListener> local_;
  std::unique_ptr<StopListener> remote_;
  std::atomic<bool> is_serving_{true};
  std::thread reporting_;
};

}  // namespace hapticd::server
