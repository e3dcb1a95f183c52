#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "hal/error.h"
#include "server/config/listen_address.h"
#include "server/metrics/rig_metrics.h"

namespace hapticd::server {

/// Answers GET /metrics, on one thread. Each answer is made from copies: the loop notices nothing. A
/// connection has so much time for its request and to take the answer. There are kMaxConnections of them,
/// shared by clients (addresses) as in fair_places.h: slow ones do not keep others out.
class MetricsServer {
 public:
  using Figures = std::function<RigFigures()>;

  /// Scrapers are few, and each asks a few times a minute.
  static constexpr std::size_t kMaxConnections = 16;
  static constexpr std::chrono::milliseconds kMaxTime{2000};

  /// Starts. An error when the address cannot be bound. `figures` is called by the server's thread.
  static hal::Result<std::unique_ptr<MetricsServer>> start(const ListenAddress& address, Figures figures,
                                                           std::chrono::milliseconds max_time = kMaxTime);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  /// The port in use.
  std::uint16_t port() const { return port_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Connection {
    int descriptor = -1;  ///< -1: free
    std::uint64_t client = 0;
    Clock::time_point begun{};
    std::string request{};
    std::string answer{};  ///< empty: it has not asked yet
    std::size_t sent = 0;
    bool says_no_more = false;  ///< its client has closed its writing side
  };

  MetricsServer(Figures figures, std::chrono::milliseconds max_time);
  void run();
  int wait_ms() const;
  void accept_some();
  /// Reads and writes what can be now.
  void serve(Connection& connection);
  std::string answer_to(std::string_view request) const;
  static void release(Connection& connection);

  const Figures figures_;
  const std::chrono::milliseconds max_time_;
  int listening_ = -1;
  int wake_ = -1;
  std::uint16_t port_ = 0;
  std::array<Connection, kMaxConnections> connections_{};
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
