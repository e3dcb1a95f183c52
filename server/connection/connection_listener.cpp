#include "server/connection/connection_listener.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "server/access/local_user.h"
#include "server/connection/listening_socket.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

/// Descriptors that no connection gets: for the store, recordings, hardware, and files that threads open
/// briefly.
constexpr rlim_t kReserve = 128;
/// What the process has open without connections.
constexpr std::size_t kUsual = 50;
/// Descriptors of a connection: its own, and a pair through which it is passed on.
constexpr std::size_t kDescriptorsPerConnection = 3;
constexpr std::size_t kMaxConnections = 2048;
/// Maximum number of tries to find two free ports next to each other.
constexpr int kMaxTries = 100;
constexpr std::chrono::milliseconds kMaxRetry{10};
/// Time for connections that wait to be served.
constexpr std::chrono::microseconds kServe{100};
/// Maximum number of connections of one address before the others have their turn.
constexpr int kMaxInTurn = 4;
constexpr std::uint64_t kRefusalsBetweenWarnings = 1000;

std::size_t max_descriptor_of_connections() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return SIZE_MAX;
  return static_cast<std::size_t>(limit.rlim_cur - std::min(kReserve, limit.rlim_cur / 2));
}

hal::Error cannot_listen(const std::string& where, const std::string& reason) {
  return {"cannot listen", where, reason, "",
          "stop the program that listens there (another hapticd?), or choose another port with --listen"};
}

hal::Error no_unix_socket(const std::string& path, const std::string& reason) {
  return {"cannot listen on the unix socket", path, reason, "",
          "check that its folder exists and may be written to, and that the path is not too long"};
}

int open_spare() {
  return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

}  // namespace

hal::Result<std::unique_ptr<ConnectionListener>> ConnectionListener::open(const Endpoints& endpoints) {
  std::unique_ptr<ConnectionListener> listener(new ConnectionListener);
  listener->is_console_user_ = endpoints.is_console_user;
  listener->max_descriptor_ = max_descriptor_of_connections();
  listener->wake_ = eventfd(0, EFD_CLOEXEC);
  listener->spare_ = open_spare();
  if (listener->wake_ < 0 || listener->spare_ < 0) {
    return cannot_listen(endpoints.loopback.text(), std::strerror(errno));
  }
  const auto bound = listener->open_tcp(endpoints.loopback, ConnectionKind::kLoopback, listener->port_);
  if (!bound) return bound.error();
  if (!endpoints.unix_socket.empty()) {
    const auto unix_bound = listener->open_unix(endpoints.unix_socket, endpoints.unix_group);
    if (!unix_bound) return unix_bound.error();
  }
  if (endpoints.tls) {
    const auto tls_bound = listener->open_tcp(*endpoints.tls, ConnectionKind::kTls, listener->tls_port_);
    if (!tls_bound) return tls_bound.error();
  }
  return listener;
}

hal::Result<bool> ConnectionListener::open_tcp(const ListenAddress& listen, ConnectionKind kind,
                                               std::uint16_t& port) {
  const std::size_t before = listening_.size();
  std::vector<int>& stops = kind == ConnectionKind::kTls ? stop_.tls : stop_.plain;
  for (int i = 1;; ++i) {
    const auto opened = try_tcp(listen, kind, port);
    if (opened || listen.port != 0 || i == kMaxTries) return opened;
    for (std::size_t at = before; at < listening_.size(); ++at) close(listening_[at].descriptor);
    listening_.resize(before);
    for (const int descriptor : stops) close(descriptor);
    stops.clear();
    port = 0;
  }
}

hal::Result<bool> ConnectionListener::try_tcp(const ListenAddress& listen, ConnectionKind kind,
                                              std::uint16_t& port) {
  std::vector<int>& stops = kind == ConnectionKind::kTls ? stop_.tls : stop_.plain;
  std::string reason;
  bool listens = false;
  for (SocketAddress& address : addresses_of(listen, reason)) {
    // Any free port: the first address finds it, the others take the same.
    if (port != 0) set_port(address, port);
    const int descriptor = listen_at(address);
    if (descriptor >= 0) {
      listens = true;
      listening_.push_back({descriptor, kind});
      if (port == 0) port = port_of(descriptor);
      set_port(address, static_cast<std::uint16_t>(port + 1));
      const int stop = port < UINT16_MAX ? listen_at(address) : -1;
      if (stop < 0) {
        return hal::Error{"cannot listen for stops, which come by the next port",
                          ListenAddress{listen.host, static_cast<std::uint16_t>(port + 1)}.text(),
                          std::strerror(errno), "a port whose next one is free, too",
                          "choose another port with --listen or --listen-tls"};
      }
      stops.push_back(stop);
      continue;
    }
    reason = std::strerror(errno);
    if (errno == EADDRINUSE) return cannot_listen(listen.text(), reason);
  }
  // If this machine lacks the second address family of a host, the first is used.
  if (!listens) return cannot_listen(listen.text(), reason);
  return true;
}

hal::Result<bool> ConnectionListener::open_unix(const std::string& path, const std::string& group) {
  SocketAddress address;
  auto& name = reinterpret_cast<sockaddr_un&>(address.bytes);
  if (path.size() >= sizeof name.sun_path) return no_unix_socket(path, "the path is too long");
  gid_t owner = getegid();
  if (!group.empty()) {
    const auto id = group_id(group);
    if (!id) {
      return hal::Error{"no such group", "[access] unix_socket_group", group, "",
                        "make it: addgroup " + group};
    }
    owner = *id;
  }
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  address.length = sizeof name;
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return no_unix_socket(path, std::strerror(errno));
  // A user who may not open it must not reach it in between either: it listens last.
  const bool bound = bind(descriptor, address.any(), address.length) == 0;
  const bool listens = bound && (group.empty() || chown(path.c_str(), static_cast<uid_t>(-1), owner) == 0) &&
                       chmod(path.c_str(), 0660) == 0 && ::listen(descriptor, SOMAXCONN) == 0;
  if (!listens) {
    const std::string reason = std::strerror(errno);
    close(descriptor);
    if (bound) unlink(path.c_str());
    return no_unix_socket(path, reason);
  }
  listening_.push_back({descriptor, ConnectionKind::kUnixSocket});
  unix_socket_ = path;
  unix_group_ = group_name(owner);
  return open_datagram(path + StopSockets::kDatagramEnding);
}

// Opens the datagram socket. All users of this machine may stop, over loopback as well: whoever may reach the
// folder may use it.
hal::Result<bool> ConnectionListener::open_datagram(const std::string& path) {
  SocketAddress address;
  auto& name = reinterpret_cast<sockaddr_un&>(address.bytes);
  if (path.size() >= sizeof name.sun_path) return no_unix_socket(path, "the path is too long");
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  address.length = sizeof name;
  struct stat present {};
  if (lstat(path.c_str(), &present) == 0) {
    if (!S_ISSOCK(present.st_mode))
      return no_unix_socket(path, "a file that is not a socket has this path");
    unlink(path.c_str());  // left behind; the lock of the unix socket shows that no other process uses it
  }
  const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (descriptor < 0) return no_unix_socket(path, std::strerror(errno));
  stop_.datagram = descriptor;
  if (setsockopt(descriptor, SOL_SOCKET, SO_PASSCRED, &on, sizeof on) != 0 ||
      bind(descriptor, address.any(), address.length) != 0) {
    return no_unix_socket(path, std::strerror(errno));
  }
  stop_.datagram_path = path;
  if (chmod(path.c_str(), 0666) != 0) return no_unix_socket(path, std::strerror(errno));
  return true;
}

std::size_t ConnectionListener::max_connections() const {
  const std::size_t left = max_descriptor_ > kUsual ? max_descriptor_ - kUsual : 0;
  return std::clamp<std::size_t>(left / kDescriptorsPerConnection, 8, kMaxConnections);
}

ConnectionListener::~ConnectionListener() {
  stop();
  for (const int descriptor : {wake_, spare_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

void ConnectionListener::start(Takers takers) {
  takers_ = std::move(takers);
  thread_ = std::thread([this] { run(); });
}

void ConnectionListener::stop() {
  if (thread_.joinable()) {
    eventfd_write(wake_, 1);
    thread_.join();
  }
  for (const Listening& listening : listening_) close(listening.descriptor);
  listening_.clear();
  if (!unix_socket_.empty()) unlink(unix_socket_.c_str());
  unix_socket_.clear();
}

void ConnectionListener::run() {
  pthread_setname_np(pthread_self(), "accept");
  std::vector<pollfd> watched{{wake_, POLLIN, 0}};
  for (const Listening& listening : listening_) watched.push_back({listening.descriptor, POLLIN, 0});
  const std::size_t count = listening_.size();
  for (std::size_t first = 0;; ++first) {  // who comes first changes: others may leave no room for the next
    if (poll(watched.data(), watched.size(), -1) < 0 && errno != EINTR) {
      log_error(std::string("connections can no longer be waited for: ") + std::strerror(errno));
      return;
    }
    if (watched[0].revents != 0) return;
    std::chrono::microseconds wait{0};
    for (std::size_t n = 0; n < count; ++n) {
      const std::size_t i = (first + n) % count;
      if (watched[1 + i].revents != 0) wait = std::max(wait, accept_some(listening_[i]));
    }
    std::this_thread::sleep_for(wait);
  }
}

std::chrono::microseconds ConnectionListener::accept_some(const Listening& listening) {
  for (int i = 0; i < kMaxInTurn; ++i) {
    if (!takers_.has_room(listening.kind)) return kServe;
    const int descriptor = accept4(listening.descriptor, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor >= 0 && static_cast<std::size_t>(descriptor) < max_descriptor_) {
      takers_.take(descriptor, kind_of(descriptor, listening.kind));
      continue;
    }
    if (descriptor >= 0) {
      close(descriptor);
      note_refused();
      continue;
    }
    if (errno == EINTR || errno == ECONNABORTED) continue;
    if (errno == EAGAIN) return {};
    if ((errno == EMFILE || errno == ENFILE) && turn_away(listening.descriptor)) continue;
    // No descriptor, or not even memory, at present. The connection waits in the queue.
    return kMaxRetry;
  }
  return {};
}

ConnectionKind ConnectionListener::kind_of(int descriptor, ConnectionKind listening) const {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (listening != ConnectionKind::kUnixSocket || !is_console_user_ ||
      getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return listening;
  }
  return is_console_user_(peer.uid) ? ConnectionKind::kConsole : listening;
}

bool ConnectionListener::turn_away(int listening) {
  if (spare_ >= 0) close(spare_);
  const int descriptor = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC);
  if (descriptor >= 0) close(descriptor);
  spare_ = open_spare();
  if (descriptor >= 0) note_refused();
  return descriptor >= 0;
}

void ConnectionListener::note_refused() {
  if (refused_++ % kRefusalsBetweenWarnings != 0) return;
  log_warning(
      "a connection is refused: no descriptors are left (" + std::to_string(refused_) +
      " so far); raise LimitNOFILE (ulimit -n), or find the client that opens connections and keeps them");
}

}  // namespace hapticd::server
