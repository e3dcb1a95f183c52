#include "server/process/memory_watch.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <fmt/format.h>
#include <linux/tcp.h>
#include <malloc.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/process/log.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLookInterval{20};
/// Where memory grows: a flood takes more than 100 MB in 20 ms.
constexpr std::chrono::milliseconds kGrowingLookInterval{2};
/// Who sends is looked at this often where memory does not grow: what came of a connection before it was seen
/// counts as sent lately.
constexpr std::chrono::seconds kTrafficInterval{1};
/// After a connection was closed until what it held is given back.
constexpr std::chrono::seconds kTrimDelay{1};

std::size_t resident_bytes() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "re"),
                                                             std::fclose);
  unsigned long pages = 0;
  if (file == nullptr || std::fscanf(file.get(), "%*u %lu", &pages) != 1) return 0;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

std::string text_of(const sockaddr_storage& address) {
  char host[INET6_ADDRSTRLEN] = "?";
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    inet_ntop(AF_INET, &v4.sin_addr, host, sizeof host);
    return fmt::format("{}:{}", host, ntohs(v4.sin_port));
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  inet_ntop(AF_INET6, &v6.sin6_addr, host, sizeof host);
  return fmt::format("[{}]:{}", host, ntohs(v6.sin6_port));
}

std::uint16_t port_of(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
  if (address.ss_family == AF_INET6) return ntohs(reinterpret_cast<const sockaddr_in6&>(address).sin6_port);
  return 0;
}

struct Connection {
  int descriptor = -1;
  std::string peer;
  std::uint64_t received = 0;  ///< bytes since it was accepted
  bool is_open = true;         ///< false once it was shut down
};

/// The connections of this process that came in on a port.
std::vector<Connection> connections_on(std::uint16_t port) {
  std::vector<Connection> found;
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir("/proc/self/fd"), closedir);
  while (const dirent* entry = folder != nullptr ? readdir(folder.get()) : nullptr) {
    char* end = nullptr;
    const long number = std::strtol(entry->d_name, &end, 10);
    if (end == entry->d_name || *end != '\0') continue;
    Connection connection;
    connection.descriptor = static_cast<int>(number);
    sockaddr_storage own{};
    sockaddr_storage peer{};
    socklen_t length = sizeof own;
    if (getsockname(connection.descriptor, reinterpret_cast<sockaddr*>(&own), &length) != 0) continue;
    if (port_of(own) != port) continue;
    length = sizeof peer;
    if (getpeername(connection.descriptor, reinterpret_cast<sockaddr*>(&peer), &length) != 0) continue;
    tcp_info info{};
    length = sizeof info;
    if (getsockopt(connection.descriptor, IPPROTO_TCP, TCP_INFO, &info, &length) != 0) continue;
    connection.peer = text_of(peer);
    connection.received = info.tcpi_bytes_received;
    constexpr int kEstablished = 1;  // TCP_ESTABLISHED: its headers do not go together
    connection.is_open = info.tcpi_state == kEstablished;
    found.push_back(std::move(connection));
  }
  return found;
}

/// How much each connection sent recently, by its peer.
class Traffic {
 public:
  /// Once a look; `connections` as they are, `interval_s` after the last look.
  void note(const std::vector<Connection>& connections, double interval_s) {
    const double kept = std::max(0.0, 1.0 - interval_s);
    std::map<std::string, Account> now;
    for (const Connection& connection : connections) {
      Account account{connection.received, connection.received};  // opened since the last look
      if (const auto known = accounts_.find(connection.peer); known != accounts_.end()) {
        account.lately = static_cast<std::uint64_t>(kept * static_cast<double>(known->second.lately)) +
                         connection.received - known->second.received;
      }
      now.emplace(connection.peer, account);
    }
    accounts_ = std::move(now);
  }
  std::uint64_t lately(const std::string& peer) const {
    const auto found = accounts_.find(peer);
    return found == accounts_.end() ? 0 : found->second.lately;
  }

 private:
  struct Account {
    std::uint64_t received = 0;
    std::uint64_t lately = 0;  ///< bytes, of about a second
  };
  std::map<std::string, Account> accounts_;
};

/// Otherwise the data in the kernel, perhaps megabytes, would all be read before the connection is seen to be
/// closed.
void discard_what_came(int descriptor) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 20U;
  constexpr int kMaxRounds = 64;
  for (int i = 0; i < kMaxRounds; ++i) {
    if (recv(descriptor, nullptr, kAtOnce, MSG_DONTWAIT | MSG_TRUNC) <= 0)
      return;  // TCP: thrown away, not copied
  }
}

/// Closes the connection that sends the most and those that send half as much, if they flood. How many. A
/// descriptor may by now be another connection's: its peer is checked again just before.
int close_floods(const std::vector<Connection>& connections, const Traffic& traffic,
                 std::size_t max_growth_bytes) {
  std::uint64_t most = 0;
  for (const Connection& connection : connections) most = std::max(most, traffic.lately(connection.peer));
  int closed = 0;
  for (const Connection& connection : connections) {
    const std::uint64_t lately = traffic.lately(connection.peer);
    if (lately < MemoryWatch::kMinFlood || lately < most / 2) continue;
    sockaddr_storage peer{};
    socklen_t length = sizeof peer;
    if (getpeername(connection.descriptor, reinterpret_cast<sockaddr*>(&peer), &length) != 0) continue;
    if (text_of(peer) != connection.peer) continue;
    discard_what_came(connection.descriptor);
    if (!connection.is_open) continue;  // closed before; what was under way came after
    if (::shutdown(connection.descriptor, SHUT_RDWR) != 0) continue;
    discard_what_came(connection.descriptor);
    log_warning(
        fmt::format("the connection of {} was closed: the service took more than {} MB of memory for its "
                    "clients, and this "
                    "one sent {} kB in about a second",
                    connection.peer, max_growth_bytes >> 20U, lately / 1000));
    ++closed;
  }
  return closed;
}

/// Ahead of all ordinary threads, so that on a busy machine, too, it looks when it is due; far behind the
/// loop. A system that grants no real-time priority leaves it where it is.
void raise_priority() {
  const sched_param lowest{.sched_priority = sched_get_priority_min(SCHED_RR)};
  static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_RR, &lowest));
}

}  // namespace

MemoryWatch::MemoryWatch(std::uint16_t port, std::size_t max_growth_bytes)
    : port_(port), max_growth_(max_growth_bytes), thread_([this] { run(); }) {}

MemoryWatch::~MemoryWatch() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ending_signal_.notify_one();
  thread_.join();
}

void MemoryWatch::run() {
  pthread_setname_np(pthread_self(), "hapticd-memory");
  raise_priority();
  Traffic traffic;
  std::size_t usual = resident_bytes();
  Clock::time_point noted = Clock::now();
  auto trim_at = Clock::time_point::max();
  std::chrono::milliseconds interval = kLookInterval;
  std::unique_lock lock(mutex_);
  while (!ending_signal_.wait_for(lock, interval, [this] { return ending_; })) {
    lock.unlock();
    const std::size_t now = resident_bytes();
    const Clock::time_point instant = Clock::now();
    const bool grows = now > usual + max_growth_ / 4;
    interval = grows ? kGrowingLookInterval : kLookInterval;
    if (grows || instant - noted >= kTrafficInterval) {
      const std::vector<Connection> connections = connections_on(port_);
      traffic.note(connections, std::chrono::duration<double>(instant - noted).count());
      noted = instant;
      if (now > usual + max_growth_ && close_floods(connections, traffic, max_growth_) > 0)
        trim_at = instant + kTrimDelay;
    }
    if (instant >= trim_at) {
      trim_at = Clock::time_point::max();
      malloc_trim(0);
      // What is left belongs to no connection any more.
      if (const std::size_t left = resident_bytes(); left > usual + max_growth_) usual = left;
    }
    lock.lock();
  }
}

}  // namespace hapticd::server
