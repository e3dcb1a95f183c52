#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/access/identity.h"
#include "server/connection/account.h"
#include "server/connection/connection_table.h"
#include "server/connection/tls_server.h"

namespace hapticd::server {

class RelayedConnection;
class RolePolicy;

/// Relay between the clients and gRPC: a thread that passes the bytes of each connection on to one end of a
/// pair of sockets, of which gRPC serves the other. It ends TLS, finds out who a client is by its
/// certificate, and counts for each identity what is under way (Http2Monitor). A client that goes beyond
/// AccountLimits loses the connection by which it does; one that is denied gets the answer to one call. So a
/// client can fill neither the memory nor the places of others:
///  - each identity has so many connections, at most half of all. For a new one its oldest connection that
///    has no call is closed;
///  - so many strangers may shake hands at once. For a new one the oldest of the address that has the most is
///    closed.
class ConnectionRelay {
 public:
  static constexpr std::size_t kMaxStrangers = 64;
  static constexpr std::size_t kMaxArrivals = 8;
  /// Time from the beginning of a connection until its client speaks HTTP/2.
  static constexpr std::chrono::seconds kMaxHandshake{10};

  struct Parts {
    const RolePolicy& policy;
    ConnectionTable& table;
    /// Has gRPC serve a descriptor. Called in the relay's thread.
    Callback<void(int descriptor)> serve;
    std::unique_ptr<TlsServer> tls{};  ///< null: connections are plain
    AccountLimits limits{};
    std::size_t max_connections = 1024;
    const char* thread_name = "hapticd-relay";
  };
  /// Starts the thread.
  explicit ConnectionRelay(Parts parts);
  /// Closes all.
  ~ConnectionRelay();
  ConnectionRelay(const ConnectionRelay&) = delete;
  ConnectionRelay& operator=(const ConnectionRelay&) = delete;

  /// Takes over the descriptor of a client, which must not block. Any thread. `who`: over TLS only the
  /// address (Identity::peer) counts.
  void take(int descriptor, Identity who);
  /// False while so many that were taken wait for the thread that no more should come. Any thread.
  bool has_room();

 private:
  struct Arrival {
    int descriptor;
    Identity who;
  };

  void run();
  void serve(RelayedConnection& connection, std::array<char, 16'384>& buffer);
  void take_arrivals();
  void begin(Arrival arrival);
  /// Admits a connection whose client is known now.
  void admit(RelayedConnection& connection, std::chrono::steady_clock::time_point now);
  /// Has gRPC serve a connection whose client has begun to speak: those that never do take none of its time.
  void open_service(RelayedConnection& connection);
  std::shared_ptr<Account> account_of(const Identity& who);
  /// False when all connections that could make room have calls.
  bool make_room(const RelayedConnection& newest, const Account& account);
  void make_room_for_stranger();
  void watch(RelayedConnection& connection);
  /// Sends no more, but waits a moment for the client to take what was sent.
  void part(RelayedConnection& connection, std::chrono::steady_clock::time_point now);
  void end_handshake(RelayedConnection& connection);
  void leave_service(RelayedConnection& connection, std::chrono::steady_clock::time_point now);
  /// Closes it. `why`: for the log; empty: no line.
  void end(RelayedConnection& connection, std::string_view why);
  void end_overdue();
  void forget_ended();
  void note(const RelayedConnection& connection, std::string_view why);

  Parts parts_;
  int epoll_ = -1;
  int wake_ = -1;
  std::map<std::uint64_t, std::unique_ptr<RelayedConnection>> connections_;  ///< the oldest first
  std::vector<std::uint64_t> ended_;
  std::map<std::string, std::shared_ptr<Account>> accounts_;  ///< by the identity's name
  std::uint64_t last_ = 0;
  std::size_t strangers_ = 0;
  std::chrono::steady_clock::time_point next_note_{};
  std::uint64_t unnoted_ = 0;

  Mutex mutex_;
  std::vector<Arrival> arrivals_ GUARDED_BY(mutex_);
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
