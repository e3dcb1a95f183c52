#include "server/metrics/metrics_server.h"

#include <fmt/format.h>
#include <poll.h>
#include <prometheus/text_serializer.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "server/connection/fair_places.h"
#include "server/connection/listening_socket.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxRequest = 8192;
/// Fewer than there are places: what has just come has its turn before others can take its place.
constexpr int kMaxInTurn = 4;
constexpr int kRetryMs = 10;

std::string http_answer(std::string_view status, std::string_view headers, std::string_view body) {
  return fmt::format("HTTP/1.1 {}\r\n{}Content-Length: {}\r\nConnection: close\r\n\r\n{}", status, headers,
                     body.size(), body);
}

}  // namespace

hal::Result<std::unique_ptr<MetricsServer>> MetricsServer::start(const ListenAddress& address,
                                                                 Figures figures,
                                                                 std::chrono::milliseconds max_time) {
  ListenAddress in_numbers = address;
  if (address.host == "localhost") in_numbers.host = "127.0.0.1";
  std::unique_ptr<MetricsServer> server(new MetricsServer(std::move(figures), max_time));
  std::string reason;
  const auto addresses = addresses_of(in_numbers, reason);
  if (!addresses.empty()) server->listening_ = listen_at(addresses.front());
  server->wake_ = eventfd(0, EFD_CLOEXEC);
  if (server->listening_ < 0 || server->wake_ < 0) {
    return hal::Error{"cannot listen for scrapes of metrics", "[metrics] listen", address.text(),
                      "an address of this machine and a port that no program uses", "choose another port"};
  }
  server->port_ = port_of(server->listening_);
  server->thread_ = std::thread([here = server.get()] { here->run(); });
  return server;
}

MetricsServer::MetricsServer(Figures figures, std::chrono::milliseconds max_time)
    : figures_(std::move(figures)), max_time_(max_time) {}

MetricsServer::~MetricsServer() {
  if (thread_.joinable()) {
    eventfd_write(wake_, 1);
    thread_.join();
  }
  for (Connection& connection : connections_) release(connection);
  for (const int descriptor : {listening_, wake_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

void MetricsServer::run() {
  pthread_setname_np(pthread_self(), "hapticd-metrics");
  std::array<pollfd, 2 + kMaxConnections> watched{};
  for (;;) {
    watched[0] = {wake_, POLLIN, 0};
    watched[1] = {listening_, POLLIN, 0};
    for (std::size_t i = 0; i < kMaxConnections; ++i) {
      const Connection& one = connections_[i];
      const short reads = one.says_no_more ? 0 : POLLIN;
      const short writes = one.sent < one.answer.size() ? POLLOUT : 0;
      watched[2 + i] = {one.descriptor, static_cast<short>(reads | writes), 0};  // poll passes over -1
    }
    if (poll(watched.data(), watched.size(), wait_ms()) < 0) continue;
    if (watched[0].revents != 0) return;
    for (std::size_t i = 0; i < kMaxConnections; ++i) {
      if (watched[2 + i].revents != 0) serve(connections_[i]);
    }
    if (watched[1].revents != 0) accept_some();
    for (Connection& one : connections_) {
      if (one.descriptor >= 0 && Clock::now() >= one.begun + max_time_) release(one);
    }
  }
}

int MetricsServer::wait_ms() const {
  auto next = Clock::time_point::max();
  for (const Connection& one : connections_) {
    if (one.descriptor >= 0) next = std::min(next, one.begun + max_time_);
  }
  if (next == Clock::time_point::max()) return -1;
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now());
  return static_cast<int>(std::max<std::int64_t>(0, wait.count()));
}

void MetricsServer::accept_some() {
  for (int i = 0; i < kMaxInTurn; ++i) {
    sockaddr_storage peer{};
    socklen_t length = sizeof peer;
    const int descriptor =
        accept4(listening_, reinterpret_cast<sockaddr*>(&peer), &length, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) {
      const bool none_left = errno == EMFILE || errno == ENFILE;
      if (none_left) poll(nullptr, 0, kRetryMs);  // the connection waits in its queue
      return;
    }
    const std::uint64_t client = client_of(peer);
    const auto free = std::find_if(connections_.begin(), connections_.end(),
                                   [](const Connection& one) { return one.descriptor < 0; });
    Connection& place =
        free != connections_.end() ? *free : *oldest_of_most(connections_, std::optional(client));
    release(place);
    place.descriptor = descriptor;
    place.client = client;
    place.begun = Clock::now();
    serve(place);  // what it has to say may be there already
  }
}

void MetricsServer::serve(Connection& connection) {
  std::array<char, 4096> bytes{};
  const ssize_t size = recv(connection.descriptor, bytes.data(), bytes.size(), 0);
  if (size < 0 && errno != EAGAIN && errno != EINTR) return release(connection);
  if (size == 0) connection.says_no_more = true;  // it may still read its answer
  if (connection.answer.empty()) {
    if (connection.says_no_more) return release(connection);
    connection.request.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(0, size)));
    if (connection.request.size() > kMaxRequest) {
      connection.answer = http_answer("431 Request Header Fields Too Large", "", "");
    } else if (connection.request.find("\r\n\r\n") != std::string::npos) {
      connection.answer = answer_to(connection.request);
    } else {
      return;
    }
  }
  const std::string_view left = std::string_view(connection.answer).substr(connection.sent);
  if (left.empty()) {  // until it closes, so that the end does not overtake the answer
    if (connection.says_no_more) release(connection);
    return;
  }
  const ssize_t sent = send(connection.descriptor, left.data(), left.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) return release(connection);
  connection.sent += static_cast<std::size_t>(std::max<ssize_t>(0, sent));
  if (connection.sent < connection.answer.size()) return;
  if (connection.says_no_more) return release(connection);
  ::shutdown(connection.descriptor, SHUT_WR);
}

std::string MetricsServer::answer_to(std::string_view request) const {
  if (!request.starts_with("GET ")) return http_answer("405 Method Not Allowed", "Allow: GET\r\n", "");
  const std::string_view target = request.substr(4, request.find_first_of(" ?\r", 4) - 4);
  if (target != "/metrics") return http_answer("404 Not Found", "", "");
  return http_answer("200 OK", "Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n",
                     prometheus::TextSerializer().Serialize(metric_families(figures_())));
}

void MetricsServer::release(Connection& connection) {
  if (connection.descriptor >= 0) close(connection.descriptor);
  connection = Connection{};
}

}  // namespace hapticd::server
