#pragma once

#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "rt/loop/spsc_ring.h"
#include "server/access/local_user.h"
#include "server/connection/tls_server.h"
#include "server/stop/stop_report.h"
#include "server/stop/stop_rights.h"

namespace hapticd::server {

/// Serves stops and nothing else, on one thread. What comes without certificates takes no memory, no lock and
/// no system call that could wait. A connection has a second for its few bytes. There are kMaxConnections of
/// them, shared by clients (users, or addresses) as in fair_places.h.
class StopListener {
 public:
  static constexpr std::size_t kMaxConnections = 64;
  static constexpr std::chrono::milliseconds kMaxWait{1000};

  struct Parts {
    std::vector<int> listening{};  ///< stay the caller's, as all descriptors here
    int datagram = -1;
    int signals = -1;          ///< of signalfd()
    TlsServer* tls = nullptr;  ///< for what listens; null: plain
    const StopRights& rights;
    const std::function<std::uint64_t()>& stop;
    int reported = -1;  ///< an eventfd that is told of each report
    const char* thread_name = "hapticd-stop";
  };
  explicit StopListener(Parts parts);
  ~StopListener();
  StopListener(const StopListener&) = delete;
  StopListener& operator=(const StopListener&) = delete;

  /// Takes a report; for one thread.
  bool pop_report(StopReport& report) noexcept { return reports_.pop(report); }
  /// Reports that found no room, since the last call.
  std::uint64_t take_lost() noexcept { return lost_.exchange(0); }

 private:
  using Clock = std::chrono::steady_clock;
  struct Connection {
    int descriptor = -1;  ///< -1: free
    std::uint64_t client = 0;
    bool may_stop = false;
    bool is_shaking_hands = false;
    bool has_come = false;  ///< something to read, or its end
    bool is_answered = false;
    Clock::time_point begun{};
    Clock::time_point until{};
    std::array<char, 16> bytes{};
    std::size_t size = 0;
    std::size_t discarded = 0;  ///< bytes that came after its answer
    StopReport report{};
    std::unique_ptr<TlsSession> tls{};
  };

  void run();
  void serve_signals();
  void serve_datagrams();
  void accept_all(int listening);
  /// Goes on with the handshake of the client that has the fewest connections, and of those the newest: a client
  /// that connects again and again keeps no other waiting, and one in the middle of many handshakes no newer one.
  void take_one_step_of_a_handshake();
  void serve(Connection& connection);
  void answer(Connection& connection, bool is_stop);
  void release(Connection& connection);
  Connection& place_for(std::uint64_t client);
  /// Closes something, for a connection for which the process has no descriptor left.
  bool free_descriptor();
  std::uint64_t stop_and_report(StopReport report);
  void hand_on(StopReport report) noexcept;

  const Parts parts_;
  PeerLookup lookup_;
  int wake_ = -1;
  int spare_ = -1;  ///< a descriptor for a stop, when there are no others
  std::array<Connection, kMaxConnections> connections_{};
  std::vector<pollfd> watched_;  ///< as large as it gets from the beginning on
  rt::SpscRing<StopReport> reports_{256};
  std::atomic<std::uint64_t> lost_{0};
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
