#include "client/cpp/stop/stop_port.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>
#include <utility>

#include "client/cpp/address.h"
#include "client/cpp/certificates.h"
#include "client/cpp/error.h"
#include "client/cpp/stop/ahead.h"
#include "client/cpp/stop/host_lookup.h"
#include "client/cpp/tls/client_context.h"

namespace hapticd::client {
namespace {

using Clock = std::chrono::steady_clock;

// The whole protocol: proto/README.md.
constexpr std::string_view kRequest = "HAPTICD STOP 1\n";
constexpr std::string_view kStopped = "HAPTICD STOPPED ";
constexpr std::size_t kAnswerSize = 33;
/// Maximum number of tries while others of the same address take its place again and again.
constexpr int kMaxTries = 50;

[[noreturn]] void fail_stop(ErrorKind kind, const std::string& what, const std::string& where,
                            const std::string& value, const std::string& remedy) {
  v1::ErrorDetail detail;
  detail.set_what(what);
  detail.set_where(where);
  detail.set_value(value);
  detail.set_remedy(remedy);
  throw Error(kind, "", detail);
}

/// Time at which a stop is given up.
struct Deadline {
  Clock::time_point at;
  int cancelled = -1;
};

/// The daemon closed the connection, for a newer one of the same address.
struct Displaced {};

class StopSocket {
 public:
  StopSocket(int family, int type) : descriptor_(socket(family, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  StopSocket(StopSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ~StopSocket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  int get() const { return descriptor_; }
  /// False when the time is over.
  bool await(short events, const Deadline& until) const {
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until.at - Clock::now()).count();
      if (left <= 0) return false;
      std::array<pollfd, 2> watched{{{descriptor_, events, 0}, {until.cancelled, POLLIN, 0}}};
      if (poll(watched.data(), watched.size(), static_cast<int>(left)) <= 0) continue;
      return watched[0].revents != 0;
    }
  }

 private:
  int descriptor_ = -1;
};

[[noreturn]] void time_over(const std::string& where) {
  fail_stop(ErrorKind::kTimedOut, "the daemon's stop port does not answer in time", where, "",
            "use the emergency stop; then look at the machine of the daemon");
}

std::uint64_t tick_of(std::string_view answer, const std::string& where) {
  if (answer.size() == kAnswerSize && answer.starts_with(kStopped)) {
    std::uint64_t tick = 0;
    std::from_chars(answer.data() + kStopped.size(), answer.data() + kAnswerSize - 1, tick, 16);
    return tick;
  }
  if (answer.starts_with("HAPTICD REFUSED")) {
    fail_stop(ErrorKind::kRefused, "the daemon refuses a stop of this client", where, "[access.denied]",
              "ask a maintainer of the rig");
  }
  fail_stop(ErrorKind::kUnreachable, "what answers there is no stop port", where, "",
            "is the port before it one of hapticd?");
}

std::uint64_t stop_by_datagram(const std::string& path, const Deadline& until) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    fail_stop(ErrorKind::kBadAddress, "the path is too long", path, "", "");
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const StopSocket socket(AF_UNIX, SOCK_DGRAM);
  const sockaddr_un any{.sun_family = AF_UNIX, .sun_path = {}};
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail_stop(ErrorKind::kUnreachable, "no daemon takes stops there", path, std::strerror(errno),
              "start hapticd, or name its address with --server or HAPTICD_SERVER");
  }
  // A separate name, which the kernel chooses, so that an answer can come. It is connected before: others can
  // send nothing to it.
  bind(socket.get(), reinterpret_cast<const sockaddr*>(&any), sizeof(sa_family_t));
  while (send(socket.get(), kRequest.data(), kRequest.size(), MSG_NOSIGNAL) < 0) {
    if (errno != EAGAIN)
      fail_stop(ErrorKind::kUnreachable, "no daemon takes stops there", path, std::strerror(errno), "");
    if (!socket.await(POLLOUT, until)) time_over(path);
  }
  std::array<char, 64> answer{};
  if (!socket.await(POLLIN, until)) time_over(path);
  const ssize_t size = recv(socket.get(), answer.data(), answer.size(), 0);
  return tick_of({answer.data(), static_cast<std::size_t>(size > 0 ? size : 0)}, path);
}

/// Connects to the first address that takes it.
StopSocket connect_until(const std::string& host, const std::string& port, const std::string& where,
                         const Deadline& until) {
  const HostAddresses found = look_up(host, port, until.at, until.cancelled);
  std::string why = found.problem;
  if (!found.first && why.empty()) time_over(where);
  for (const addrinfo* one = found.first.get(); one != nullptr; one = one->ai_next) {
    StopSocket socket(one->ai_family, SOCK_STREAM);
    const int on = 1;
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    int problem = connect(socket.get(), one->ai_addr, one->ai_addrlen) == 0 ? 0 : errno;
    if (problem == EINPROGRESS) {
      if (!socket.await(POLLOUT, until)) time_over(where);
      socklen_t length = sizeof problem;
      getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &problem, &length);
    }
    if (problem == 0) return socket;
    why = std::strerror(problem);
  }
  fail_stop(ErrorKind::kUnreachable, "no daemon takes stops there", where, why,
            "start hapticd, or name its address with --server or HAPTICD_SERVER");
}

std::uint64_t stop_plain(const StopSocket& socket, const std::string& where, const Deadline& until) {
  send(socket.get(), kRequest.data(), kRequest.size(), MSG_NOSIGNAL);
  std::array<char, kAnswerSize> answer{};
  std::size_t size = 0;
  while (size < answer.size()) {
    if (!socket.await(POLLIN, until)) time_over(where);
    const ssize_t n = recv(socket.get(), answer.data() + size, answer.size() - size, 0);
    if (n <= 0 && errno != EAGAIN) break;
    if (n == 0) break;
    if (n > 0) size += static_cast<std::size_t>(n);
  }
  return tick_of({answer.data(), size}, where);
}

std::uint64_t stop_with_certificates(const StopSocket& socket, const std::string& host,
                                     const TlsContext& context, const std::string& where,
                                     const Deadline& until) {
  const NoPipeSignal held;
  const TlsSession tls(SSL_new(context.get()));
  SSL_set_fd(tls.get(), socket.get());
  std::string shown_host = host;  // what the macro SSL_set_tlsext_host_name does, without its cast
  SSL_ctrl(tls.get(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name, shown_host.data());
  SSL_set_verify(tls.get(), SSL_VERIFY_PEER, nullptr);
  auto* rules = SSL_get0_param(tls.get());
  if (X509_VERIFY_PARAM_set1_ip_asc(rules, host.c_str()) != 1)
    X509_VERIFY_PARAM_set1_host(rules, host.c_str(), 0);
  /// Tries until it succeeds; the end of the connection is an error.
  const auto complete = [&](auto&& step) {
    for (;;) {
      ERR_clear_error();
      const int result = step();
      if (result > 0) return result;
      const int error = SSL_get_error(tls.get(), result);
      // Without an alert, which a refusal has.
      const bool has_just_ended =
          error == SSL_ERROR_SYSCALL ||
          (error == SSL_ERROR_SSL && ERR_GET_REASON(ERR_peek_error()) == SSL_R_UNEXPECTED_EOF_WHILE_READING);
      if (has_just_ended) throw Displaced{};
      if (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE) {
        fail_stop(ErrorKind::kUnreachable, "no encrypted connection to the stop port comes about", where,
                  newest_tls_problem("the connection broke"),
                  "compare the certificates of both sides, see docs/access.md");
      }
      if (!socket.await(error == SSL_ERROR_WANT_WRITE ? POLLOUT : POLLIN, until)) time_over(where);
    }
  };
  complete([&] { return SSL_connect(tls.get()); });
  complete([&] { return SSL_write(tls.get(), kRequest.data(), static_cast<int>(kRequest.size())); });
  std::array<char, kAnswerSize> answer{};
  std::size_t size = 0;
  while (size < answer.size()) {
    size += static_cast<std::size_t>(complete(
        [&] { return SSL_read(tls.get(), answer.data() + size, static_cast<int>(answer.size() - size)); }));
  }
  return tick_of({answer.data(), size}, where);
}

}  // namespace

std::uint64_t stop_by_stop_port(const std::string& address, const std::string& certificates,
                                std::chrono::milliseconds timeout, int cancelled) {
  const Deadline until{Clock::now() + timeout, cancelled};
  const Ahead ahead;
  channel_target(address);  // throws if it is not an address
  constexpr std::string_view kUnix = "unix:";
  if (address.starts_with(kUnix)) return stop_by_datagram(address.substr(kUnix.size()) + ".stop", until);
  TlsContext context;
  if (needs_certificates(address)) {
    const CertificateFiles files = find_certificates(address, certificates);
    context = client_context(files.certificate, files.key, files.authority);
    if (!context) {
      fail_stop(ErrorKind::kBadAddress, "the certificates of this client cannot be used", files.certificate,
                newest_tls_problem("they cannot be read"), "ask a maintainer of the rig for others");
    }
  }
  const std::string host = host_of(address);
  const std::string port = std::to_string(std::stoi(port_of(address)) + 1);
  const std::string where = address.substr(0, address.rfind(':')) + ":" + port;
  for (int tries = 1;; ++tries) {
    const StopSocket socket = connect_until(host, port, where, until);
    try {
      return context ? stop_with_certificates(socket, host, context, where, until)
                     : stop_plain(socket, where, until);
    } catch (const Displaced&) {
      if (tries == kMaxTries) {
        fail_stop(
            ErrorKind::kUnreachable, "the stop port closes each connection", where, "",
            "end what else connects to it from this address, and compare the certificates of both sides");
      }
    }
  }
}

}  // namespace hapticd::client
