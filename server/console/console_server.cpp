#include "server/console/console_server.h"

#include <fmt/format.h>
#include <grpcpp/channel.h>
#include <pthread.h>

#include <chrono>
#include <filesystem>
#include <list>
#include <thread>
#include <utility>

#include "server/access/certificate.h"
#include "server/console/console_shared.h"
#include "server/console/http_connection.h"
#include "server/console/peer_certificate.h"
#include "server/process/crash_guard.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;

namespace {

/// Of browsers that ask for pages; sockets are counted apart.
constexpr std::size_t kMaxConnections = 128;
constexpr std::chrono::milliseconds kRetry{50};
constexpr std::chrono::seconds kLookAgain{1};

hal::Error cannot_listen(const ListenAddress& address, const std::string& reason) {
  return {"the console cannot listen: " + reason, "[console]", address.text(),
          "an address of this machine and a port that no program uses", "choose another port"};
}

bool is_any(const ListenAddress& address) {
  return address.host == "0.0.0.0" || address.host == "::";
}

std::filesystem::file_time_type newest(const std::string& folder) {
  const CertificateFiles files = CertificateFiles::in(folder);
  std::filesystem::file_time_type time = std::filesystem::file_time_type::min();
  for (const std::string& path : {files.certificate, files.key, files.authority}) {
    std::error_code missing;
    if (const auto of_one = std::filesystem::last_write_time(path, missing); !missing)
      time = std::max(time, of_one);
  }
  return time;
}

}  // namespace

struct ConsoleServer::State {
  State(const ConsoleConfig& configuration, Parts parts)
      : config(configuration),
        certificates(parts.certificates),
        bridge(std::make_unique<RpcBridge>(parts.channel)) {
    std::vector<std::string> names = config.names;
    if (config.listen) names.push_back(config.listen->host);
    std::vector<std::string> tls_names = names;
    if (config.listen_tls && !is_any(*config.listen_tls)) tls_names.push_back(config.listen_tls->host);
    shared = std::make_shared<ConsoleShared>(
        ConsoleShared{.config = config,
                      .door = parts.door,
                      .policy = parts.policy,
                      .bridge = *bridge,
                      .post = [this](std::function<void()> call) { asio::post(context, std::move(call)); },
                      .loop_rate_hz = parts.loop_rate_hz,
                      .plain_guard = RequestGuard(names, false),
                      .tls_guard = RequestGuard(tls_names, true),
                      .cookie = {},
                      .rates = {},
                      .feeds = {}});
  }
  ~State() {
    context.stop();
    if (thread.joinable()) thread.join();
    bridge.reset();
  }

  hal::Result<bool> listen(const ListenAddress& address, bool is_tls, std::uint16_t& port);
  void accept(Tcp::acceptor& acceptor, bool is_tls);
  void take(Tcp::socket socket, bool is_tls);
  /// False where there is no place, and none can be made.
  bool make_place();
  void renew_certificates();
  void run();

  const ConsoleConfig config;
  const std::string certificates;
  asio::io_context context{1};
  asio::steady_timer retry{context};
  std::unique_ptr<RpcBridge> bridge;
  std::shared_ptr<ConsoleShared> shared;
  std::list<Tcp::acceptor> acceptors;
  std::list<std::weak_ptr<HttpConnection>> connections;  ///< the oldest first
  std::shared_ptr<asio::ssl::context> tls;
  std::filesystem::file_time_type tls_time{};
  std::chrono::steady_clock::time_point tls_looked_at{};
  std::uint16_t port = 0;
  std::uint16_t tls_port = 0;
  std::thread thread;
};

hal::Result<bool> ConsoleServer::State::listen(const ListenAddress& address, bool is_tls,
                                               std::uint16_t& bound) {
  boost::system::error_code error;
  const std::string host = address.host == "localhost" ? "127.0.0.1" : address.host;
  const Tcp::endpoint endpoint(asio::ip::make_address(host, error), address.port);
  if (error) return cannot_listen(address, error.message());
  Tcp::acceptor acceptor(context);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return cannot_listen(address, error.message());
  bound = acceptor.local_endpoint().port();
  acceptors.push_back(std::move(acceptor));
  accept(acceptors.back(), is_tls);
  return true;
}

void ConsoleServer::State::accept(Tcp::acceptor& acceptor, bool is_tls) {
  acceptor.async_accept([this, &acceptor, is_tls](boost::system::error_code error, Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      take(std::move(socket), is_tls);
      return accept(acceptor, is_tls);
    }
    // No descriptor at present.
    retry.expires_after(kRetry);
    retry.async_wait([this, &acceptor, is_tls](boost::system::error_code) { accept(acceptor, is_tls); });
  });
}

bool ConsoleServer::State::make_place() {
  connections.remove_if([](const auto& weak) { return weak.expired(); });
  if (connections.size() < kMaxConnections) return true;
  // Who is known stays longest: strangers cannot keep a stop from its way.
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
  if (is_tls) {
    renew_certificates();
    transport.use_tls(tls);
  }
  const auto connection = std::make_shared<HttpConnection>(std::move(transport), shared);
  connections.push_back(connection);
  connection->start();
}

void ConsoleServer::State::renew_certificates() {
  const auto now = std::chrono::steady_clock::now();
  if (now - tls_looked_at < kLookAgain) return;
  tls_looked_at = now;
  const auto time = newest(certificates);
  if (time == tls_time) return;
  tls_time = time;
  auto renewed = tls_context_from(certificates);
  if (renewed) {
    tls = *renewed;
  } else {
    log_warning("the console keeps its certificates: " + renewed.error().text());
  }
}

void ConsoleServer::State::run() {
  pthread_setname_np(pthread_self(), "console");
  use_crash_stack();
  for (;;) {
    try {
      context.run();
      return;
    } catch (const std::exception& error) {  // of one connection, e.g. out of memory
      log_error(std::string("console: ") + error.what());
    }
  }
}

ConsoleServer::ConsoleServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

ConsoleServer::~ConsoleServer() = default;

hal::Result<std::unique_ptr<ConsoleServer>> ConsoleServer::start(const ConsoleConfig& config, Parts parts) {
  auto state = std::make_unique<State>(config, std::move(parts));
  if (config.listen) {
    const auto bound = state->listen(*config.listen, false, state->port);
    if (!bound) return bound.error();
  }
  if (config.listen_tls) {
    auto tls = tls_context_from(state->certificates);
    if (!tls) return tls.error();
    state->tls = *tls;
    state->tls_time = newest(state->certificates);
    const auto bound = state->listen(*config.listen_tls, true, state->tls_port);
    if (!bound) return bound.error();
  }
  state->shared->cookie = fmt::format("hapticd_{}", state->port);
  state->thread = std::thread([here = state.get()] { here->run(); });
  std::unique_ptr<ConsoleServer> server(new ConsoleServer(std::move(state)));
  log_info("the console is shown on " + (config.listen ? server->url() : server->tls_url()) +
           ": hapticctl console opens it");
  return server;
}

std::uint16_t ConsoleServer::port() const {
  return state_->port;
}

std::uint16_t ConsoleServer::tls_port() const {
  return state_->tls_port;
}

std::string ConsoleServer::url() const {
  if (!state_->config.listen) return {};
  return "http://" + ListenAddress{state_->config.listen->host, state_->port}.text();
}

std::string ConsoleServer::tls_url() const {
  if (!state_->config.listen_tls) return {};
  const std::string& host = state_->config.listen_tls->host;
  const std::string name = !is_any(*state_->config.listen_tls) ? host
                           : state_->config.names.empty()      ? "localhost"
                                                               : state_->config.names.front();
  return "https://" + ListenAddress{name, state_->tls_port}.text();
}

}  // namespace hapticd::server
