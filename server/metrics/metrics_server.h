#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "hal/error.h"
#include "server/config/listen_address.h"
#include "server/metrics/rig_metrics.h"

namespace hapticd::server {

/// Answers GET /metrics. Each answer is made from copies: the loop notices nothing.
class MetricsServer {
 public:
  using Figures = std::function<RigFigures()>;

  /// Starts. An error when the address cannot be bound. `figures` is called by threads of the server.
  static hal::Result<std::unique_ptr<MetricsServer>> start(const ListenAddress& address, Figures figures);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  /// The port in use.
  std::uint16_t port() const { return port_; }

 private:
  struct State;
  MetricsServer(std::unique_ptr<State> state, std::uint16_t port);
  std::unique_ptr<State> state_;
  std::uint16_t port_;
};

}  // namespace hapticd::server
