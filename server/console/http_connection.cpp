#include "server/console/http_connection.h"

#include <fmt/format.h>

#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <string>
#include <utility>

#include "server/console/page_files.h"
#include "server/console/peer_certificate.h"
#include "server/console/socket_session.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace beast = boost::beast;
namespace http = beast::http;

namespace {

constexpr std::uint32_t kMaxHeader = 16U << 10U;
constexpr std::uint64_t kMaxBody = 256U << 10U;
constexpr std::chrono::seconds kHandshakeTime{10};
constexpr std::chrono::seconds kFirstRequestTime{5};
constexpr std::chrono::seconds kIdleTime{75};
constexpr std::chrono::seconds kWriteTime{10};
constexpr std::string_view kStop = "hapticd.v1.SafetyService/Stop";
constexpr const char* kSecurityPolicy =
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'; object-src 'none'";

std::string_view text_of(beast::string_view view) {
  return {view.data(), view.size()};
}

beast::string_view view_of(std::string_view text) {
  return {text.data(), text.size()};
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

/// For who opens the console without being signed in, or by a wrong name.
std::string page_of_refusal(const std::string& why) {
  return "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width\"><title>hapticd</title><link rel=\"stylesheet\" "
         "href=\"/console.css\">"
         "<main class=\"refusal\"><h1>hapticd</h1><p>" +
         escaped(why) + "</p></main></html>";
}

std::uint64_t checksum(std::string_view text) {
  std::uint64_t sum = 14695981039346656037ULL;  // FNV-1a
  for (const char c : text) sum = (sum ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return sum;
}

}  // namespace

HttpConnection::HttpConnection(Transport transport, std::shared_ptr<ConsoleShared> shared)
    : transport_(std::move(transport)), shared_(std::move(shared)) {}

HttpConnection::~HttpConnection() = default;

void HttpConnection::start() {
  if (transport_.has_tls()) return shake_hands();
  read();
}

void HttpConnection::shake_hands() {
  transport_.next_layer().expires_after(kHandshakeTime);
  is_waiting_ = true;
  transport_.async_handshake([self = shared_from_this()](beast::error_code error) {
    if (error) return;
    const Identity who = identity_of_peer(self->transport_.ssl(), self->shared_->policy);
    self->is_denied_ = who.is_denied;
    self->denied_why_ = who.denied_why;
    if (!who.is_denied) self->by_certificate_ = self->shared_->door.session_of(who);
    self->session_ = self->by_certificate_;
    self->read();
  });
}

void HttpConnection::close() {
  beast::error_code ignored;
  transport_.next_layer().socket().close(ignored);
}

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  parser_->body_limit(kMaxBody);
  transport_.next_layer().expires_after(session_ ? kIdleTime : kFirstRequestTime);
  is_waiting_ = true;
  http::async_read(transport_, buffer_, *parser_,
                   [self = shared_from_this()](beast::error_code error, std::size_t) {
                     self->is_waiting_ = false;
                     self->on_read(error);
                   });
}

void HttpConnection::on_read(beast::error_code error) {
  const bool too_large = error == http::error::body_limit || error == http::error::header_limit;
  if (error && !too_large) return;  // gone, or no HTTP
  request_ = too_large ? Request{} : parser_->release();
  if (too_large) {
    request_.keep_alive(false);
    return reply(error == http::error::body_limit ? 413 : 431, "text/plain",
                 "larger than the console takes: 256 kB, headers 16 kB\n");
  }
  handle();
}

std::string_view HttpConnection::header(http::field name) const {
  return text_of(request_[name]);
}

std::string_view HttpConnection::header(const char* name) const {
  return text_of(request_[name]);
}

ConsoleShared::Session HttpConnection::find_session() const {
  if (transport_.has_tls()) return by_certificate_;
  const std::string_view cookie = cookie_value(header(http::field::cookie), shared_->cookie);
  return cookie.empty() ? nullptr : shared_->door.session_of(cookie);
}

std::string HttpConnection::peer() const {
  beast::error_code error;
  const auto end = transport_.next_layer().socket().remote_endpoint(error);
  if (error) return "unknown";
  return fmt::format("{}:{}", end.address().to_string(), end.port());
}

void HttpConnection::handle() {
  const RequestGuard& guard = transport_.has_tls() ? shared_->tls_guard : shared_->plain_guard;
  const RequestOrigin from{header(http::field::host), header(http::field::origin), header("Sec-Fetch-Site"),
                           header(http::field::content_type), header("X-Hapticd")};
  const std::string target = std::string(text_of(request_.target()));
  const std::string path = target.substr(0, target.find('?'));
  const bool is_get = request_.method() == http::verb::get || request_.method() == http::verb::head;
  const bool is_post = request_.method() == http::verb::post;
  const std::string method = path.starts_with("/rpc/") ? path.substr(5) : std::string();

  auto refusal = guard.check(from);
  if (!refusal && is_post) refusal = guard.check_post(from);
  const bool wants_socket = !refusal && is_get && path == "/live";
  if (wants_socket) refusal = guard.check_socket(from);
  if (refusal) {
    log_debug("console: " + peer() + ": " + refusal->why);
    return refuse(refusal->http_status, refusal->why);
  }
  if (is_denied_) return refuse(403, "this certificate is on the deny list: " + denied_why_);
  session_ = find_session();
  if (method != kStop && !shared_->may_ask(session_)) {
    return refuse(429, "too many requests; wait a second");
  }
  if (!is_get && !is_post) return refuse(405, "GET and POST only");
  if (is_get && path == "/open") return sign_in(target.substr(std::min(target.size(), path.size() + 1)));
  // The stylesheet has no secret, and the page that says how to sign in needs it.
  if (!session_ && path != "/console.css") {
    return refuse(401,
                  "This browser is not signed in. Run on the rig's machine: hapticctl console. It opens the "
                  "console here "
                  "with a key that works once.");
  }
  if (wants_socket) return become_socket();
  if (is_post && !method.empty()) return serve_rpc(method);
  if (is_get) return serve_file(path);
  refuse(404, "there is nothing here");
}

void HttpConnection::serve_file(std::string_view path) {
  const PageFile* file = page_file_at(path);
  if (file == nullptr) return refuse(404, "there is no such page");
  const std::string tag = fmt::format("\"{:016x}\"", checksum(file->text));
  const bool known = header(http::field::if_none_match) == tag;
  Response response = make(known ? 304 : 200, content_type_of(file->name));
  response.set(http::field::etag, tag);
  response.set(http::field::cache_control, "no-cache");  // ask whether it is still the same
  if (!known && request_.method() != http::verb::head) response.body() = file->text;
  send(std::move(response));
}

void HttpConnection::sign_in(std::string_view query) {
  constexpr std::string_view kKey = "key=";
  const auto cookie = query.starts_with(kKey) ? shared_->door.redeem(query.substr(kKey.size()))
                                              : std::optional<std::string>{};
  if (!cookie) {
    return refuse(
        401,
        "This address was opened before, or more than a minute ago: it works once. Run hapticctl console "
        "again.");
  }
  // Not a redirection: to a page that another one led to, browsers would not show a cookie of this kind.
  Response response = make(200, "text/html; charset=utf-8");
  response.body() =
      "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=/\">"
      "<title>hapticd</title>\n";
  response.set(http::field::set_cookie,
               fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}", shared_->cookie, *cookie,
                           static_cast<long long>(shared_->config.session_h * 3600.0),
                           transport_.has_tls() ? "; Secure" : ""));
  send(std::move(response));
}

void HttpConnection::serve_rpc(std::string_view method) {
  const ConsoleCaller caller{session_->pass, peer(), std::string(header("X-Hapticd-Lease"))};
  shared_->bridge.call(method, request_.body(), caller,
                       [self = shared_from_this(), post = shared_->post](RpcEnd end) {
                         post([self, end = std::move(end)]() mutable {
                           self->reply(end.http_status, "application/json", std::move(end.json));
                         });
                       });
}

void HttpConnection::become_socket() {
  if (!beast::websocket::is_upgrade(request_)) return refuse(426, "/live is a WebSocket");
  if (shared_->sockets >= static_cast<std::size_t>(shared_->config.max_sockets)) {
    return refuse(503, "too many pages are open: [console] max_sockets");
  }
  transport_.next_layer().expires_never();
  const ConsoleCaller caller{session_->pass, peer(), {}};
  SocketSession::begin(std::move(transport_), std::move(request_), shared_, caller);
}

void HttpConnection::refuse(unsigned status, const std::string& why) {
  if (status >= 400 && status != 401 && status != 404) request_.keep_alive(false);
  if (request_.method() == http::verb::post) {
    const grpc::StatusCode code = status == 401   ? grpc::StatusCode::UNAUTHENTICATED
                                  : status == 404 ? grpc::StatusCode::UNIMPLEMENTED
                                  : status == 429 ? grpc::StatusCode::RESOURCE_EXHAUSTED
                                                  : grpc::StatusCode::PERMISSION_DENIED;
    return reply(status, "application/json", refuse_rpc(code, {why, "console", "", "", ""}).json);
  }
  reply(status, "text/html; charset=utf-8", page_of_refusal(why));
}

HttpConnection::Response HttpConnection::make(unsigned status, std::string_view type) const {
  Response response{static_cast<http::status>(status), request_.version() == 0 ? 11 : request_.version()};
  response.keep_alive(request_.keep_alive());
  response.set(http::field::content_type, view_of(type));
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy", kSecurityPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "SAMEORIGIN");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  return response;
}

void HttpConnection::reply(unsigned status, std::string_view type, std::string body) {
  Response response = make(status, type);
  response.body() = std::move(body);
  send(std::move(response));
}

void HttpConnection::send(Response response) {
  response.prepare_payload();
  const auto kept = std::make_shared<Response>(std::move(response));
  transport_.next_layer().expires_after(kWriteTime);
  http::async_write(
      transport_, *kept, [self = shared_from_this(), kept](beast::error_code error, std::size_t) {
        if (error) return;
        if (kept->keep_alive()) return self->read();
        self->transport_.next_layer().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
      });
}

}  // namespace hapticd::server
