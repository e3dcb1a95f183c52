#include "client/console/console_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <list>
#include <optional>
#include <stdexcept>
#include <utility>

#include "client/console/access/peer_certificate.h"
#include "client/console/console_shared.h"
#include "client/console/http_connection.h"
#include "client/console/socket_session.h"
#include "client/cpp/channel.h"
#include "hapticd/v1/access.pb.h"

namespace hapticd::console {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;

namespace {

/// Connections that ask for pages; sockets are counted apart.
constexpr std::size_t kMaxConnections = 128;
constexpr std::size_t kMaxChannels = 32;
constexpr std::chrono::milliseconds kRetry{50};
constexpr std::chrono::seconds kLook{1};
/// How long a personal console waits for its first page, and for one that comes back.
constexpr std::chrono::seconds kFirstPage{120};
constexpr std::chrono::seconds kNextPage{10};

/// Connects again soon after the daemon was away.
grpc::ChannelArguments eager() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 2000);  // how long one attempt may take
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 300);
  return arguments;
}

Tcp::acceptor listen_at(asio::io_context& context, const PageAddress& address) {
  boost::system::error_code error;
  Tcp::acceptor acceptor(context);
  acceptor.open(address.endpoint.protocol(), error);
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(address.endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("cannot listen on {}: {}; choose an address of this machine and a port "
                    "that no program uses",
                    address.text(address.endpoint.port()), error.message()));
  }
  return acceptor;
}

/// One address, and the pause after a connection could not be accepted.
struct Listening {
  Listening(asio::io_context& context, const PageAddress& address, bool tls)
      : acceptor(listen_at(context, address)),
        retry(context),
        is_tls(tls),
        port(acceptor.local_endpoint().port()) {}
  Tcp::acceptor acceptor;
  asio::steady_timer retry;
  const bool is_tls;
  const std::uint16_t port;
};

std::string tls_url_of(const Options& options, std::uint16_t port) {
  const PageAddress& address = *options.listen_tls;
  if (!address.endpoint.address().is_unspecified()) return "https://" + address.text(port);
  return fmt::format("https://{}:{}", options.names.empty() ? "localhost" : options.names.front(), port);
}

}  // namespace

struct ConsoleServer::State {
  explicit State(const Options& given);
  ~State();
  std::shared_ptr<ConsoleShared> share();
  std::shared_ptr<DaemonMonitor> watch_daemon();
  void accept(Listening& listening);
  void take(Tcp::socket socket, bool is_tls);
  /// Makes room for one more connection; false if that is impossible.
  bool make_place();
  /// Looks once a second: the life sign for systemd, and the end of a console without pages.
  void look();
  void close_pages();

  const Options options;
  asio::io_context context{1};
  asio::signal_set signals{context, SIGTERM, SIGINT};
  asio::steady_timer timer{context};
  std::optional<PageCertificates> certificates;
  std::list<Listening> listening;
  std::string url;
  std::string tls_url;
  RpcBridge bridge;
  RpcBridge stop_bridge;
  StopPort stop_port;
  std::shared_ptr<ConsoleShared> shared;
  std::list<std::weak_ptr<HttpConnection>> connections;  ///< the oldest first
  std::function<void()> ready;
  std::chrono::steady_clock::time_point started_at{};
  bool had_page = false;
};

ConsoleServer::State::State(const Options& given)
    : options(given),
      bridge([this] { return client::make_channel(options.daemon, eager()); }, kMaxChannels),
      stop_bridge([this] { return client::make_channel(options.daemon, eager()); }, 1),
      stop_port(options.daemon.address, options.daemon.certificates) {
  if (options.listen) {
    listening.emplace_back(context, *options.listen, false);
    url = "http://" + options.listen->text(listening.back().port);
  }
  if (options.listen_tls) {
    certificates.emplace(options.daemon.certificates);
    listening.emplace_back(context, *options.listen_tls, true);
    tls_url = tls_url_of(options, listening.back().port);
  }
  shared = share();
  shared->watch = watch_daemon();
}

ConsoleServer::State::~State() {
  context.stop();
  shared->watch.reset();
}

std::shared_ptr<ConsoleShared> ConsoleServer::State::share() {
  std::vector<std::string> names = options.names;
  if (options.listen) names.push_back(options.listen->host);
  std::vector<std::string> tls_names = names;
  if (options.listen_tls && !options.listen_tls->endpoint.address().is_unspecified()) {
    tls_names.push_back(options.listen_tls->host);
  }
  const std::uint16_t port = options.listen ? listening.front().port : 0;
  const std::chrono::seconds life(static_cast<long>(options.session_h * 3600.0));
  return std::make_shared<ConsoleShared>(
      ConsoleShared{.options = options,
                    .sign_in = SignIn(options.is_personal ? std::string() : options.state, life, port),
                    .bridge = bridge,
                    .stop_bridge = stop_bridge,
                    .stop_port = stop_port,
                    .post = [this](std::function<void()> call) { asio::post(context, std::move(call)); },
                    .plain_guard = RequestGuard(names, false),
                    .tls_guard = RequestGuard(tls_names, true),
                    .cookie = fmt::format("hapticd_{}", port),
                    .own_key = options.is_personal ? new_key() : std::string(),
                    .watch = {},
                    .rates = {},
                    .feeds = {},
                    .sockets = {}});
}

std::shared_ptr<DaemonMonitor> ConsoleServer::State::watch_daemon() {
  std::optional<v1::ReportConsoleRequest> report;
  if (!options.is_personal) {
    report.emplace();
    report->set_url(url);
    report->set_tls_url(tls_url);
  }
  return std::make_shared<DaemonMonitor>(
      context.get_executor(),
      DaemonMonitor::Parts{.bridge = stop_bridge,
                           .report = std::move(report),
                           .post = shared->post,
                           .on_loss =
                               [this] {
                                 spdlog::warn("the daemon at {} does not answer", options.daemon.address);
                                 close_pages();
                               },
                           .on_first_answer = [this] { ready(); },
                           .on_refusal =
                               [](const std::string& why) {
                                 spdlog::error(
                                     "the daemon refuses this console: {}; see [console] user in the "
                                     "daemon's configuration, docs/access.md",
                                     why);
                               }});
}

void ConsoleServer::State::accept(Listening& from) {
  from.acceptor.async_accept([this, &from](boost::system::error_code error, Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      accept(from);  // first: a connection that fails does not keep the next one out
      return take(std::move(socket), from.is_tls);
    }
    // No descriptor at present.
    from.retry.expires_after(kRetry);
    from.retry.async_wait([this, &from](boost::system::error_code aborted) {
      if (!aborted) accept(from);
    });
  });
}

bool ConsoleServer::State::make_place() {
  connections.remove_if([](const auto& weak) { return weak.expired(); });
  if (connections.size() < kMaxConnections) return true;
  // Browsers that are signed in stay longest: strangers cannot take the place of a stop.
  for (const bool only_strangers : {true, false}) {
    for (const auto& weak : connections) {
      const auto connection = weak.lock();
      if (!connection || !(only_strangers ? connection->is_strange() : connection->is_idle())) continue;
      connection->close();
      connections.remove_if([&](const auto& entry) { return entry.lock() == connection; });
      return true;
    }
  }
  return false;
}

void ConsoleServer::State::take(Tcp::socket socket, bool is_tls) {
  if (!make_place()) return;
  boost::system::error_code ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  Transport transport(std::move(socket));
  if (is_tls) transport.use_tls(certificates->current());
  const auto connection = std::make_shared<HttpConnection>(std::move(transport), shared);
  connections.push_back(connection);
  connection->start();
}

void ConsoleServer::State::look() {
  sd_notify(0, "WATCHDOG=1");
  const auto now = std::chrono::steady_clock::now();
  if (shared->count_sockets() > 0) shared->last_used = now;
  had_page = had_page || shared->last_used != std::chrono::steady_clock::time_point{};
  const bool is_over = had_page ? now - shared->last_used > kNextPage : now - started_at > kFirstPage;
  if (options.is_personal && is_over) return context.stop();
  timer.expires_after(kLook);
  timer.async_wait([this](boost::system::error_code aborted) {
    if (!aborted) look();
  });
}

void ConsoleServer::State::close_pages() {
  // Each page then tries to come back, and says meanwhile that what it shows is old.
  const auto open = shared->sockets;
  for (const auto& weak : open) {
    if (const auto session = weak.lock()) session->end_for_loss();
  }
}

ConsoleServer::ConsoleServer(const Options& options) : state_(std::make_unique<State>(options)) {}

ConsoleServer::~ConsoleServer() = default;

void ConsoleServer::run(const std::function<void()>& ready) {
  state_->ready = ready;
  state_->started_at = std::chrono::steady_clock::now();
  state_->signals.async_wait([this](boost::system::error_code, int) { state_->context.stop(); });
  for (Listening& listening : state_->listening) state_->accept(listening);
  state_->shared->watch->start();
  state_->look();
  while (!state_->context.stopped()) {
    try {
      // Rows for pages come when there is nothing else to do: a stop waits for those of one page at most.
      if (state_->context.poll() == 0 && !state_->shared->send_next_rows()) state_->context.run_one();
    } catch (const std::exception& error) {  // of one connection, e.g. out of memory
      spdlog::error("a request failed: {}", error.what());
    }
  }
}

std::string ConsoleServer::url() const {
  if (state_->url.empty()) return state_->tls_url;
  return state_->shared->own_key.empty() ? state_->url : state_->url + "/open?key=" + state_->shared->own_key;
}

}  // namespace hapticd::console
