#include "client/console/http_connection.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <limits>
#include <string>
#include <utility>

#include "client/console/access/connection_user.h"
#include "client/console/access/metadata_value.h"
#include "client/console/access/peer_certificate.h"
#include "client/console/daemon/stop.h"
#include "client/console/page_files.h"
#include "client/console/socket_session.h"
#include "hapticd/v1/access.pb.h"

namespace hapticd::console {

namespace beast = boost::beast;
namespace http = beast::http;

namespace {

constexpr std::uint32_t kMaxHeader = 16U << 10U;
constexpr std::uint64_t kMaxBody = 256U << 10U;
constexpr std::chrono::seconds kHandshakeTime{10};
constexpr std::chrono::seconds kFirstRequestTime{5};
constexpr std::chrono::seconds kIdleTime{75};
constexpr std::chrono::seconds kWriteTime{10};
/// How long a stop waits for the rest of its body, which says why.
constexpr std::chrono::milliseconds kStopBodyTime{5};
constexpr std::chrono::seconds kDrainTime{2};
constexpr std::size_t kMaxDrained = 16U << 20U;
constexpr std::string_view kStop = "hapticd.v1.SafetyService/Stop";
constexpr const char* kRedeemPath = "/hapticd.v1.AccessService/RedeemConsoleKey";
constexpr const char* kSecurityPolicy =
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'; object-src 'none'";

std::string_view text_of(beast::string_view view) {
  return {view.data(), view.size()};
}

beast::string_view view_of(std::string_view text) {
  return {text.data(), text.size()};
}

/// True if what came is not HTTP.
bool is_malformed(const beast::error_code& error) {
  return error.category() == http::make_error_code(http::error::bad_value).category() &&
         error != http::error::end_of_stream && error != http::error::partial_message;
}

}  // namespace

HttpConnection::HttpConnection(Transport transport, std::shared_ptr<ConsoleShared> shared)
    : transport_(std::move(transport)), shared_(std::move(shared)), stop_timer_(transport_.get_executor()) {}

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
    self->by_certificate_ = session_of_peer(self->transport_.ssl());
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
  parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // which there is depends on the header
  request_ = {};
  has_unread_body_ = false;
  transport_.next_layer().expires_after(session_ ? kIdleTime : kFirstRequestTime);
  is_waiting_ = true;
  http::async_read_header(transport_, buffer_, *parser_,
                          [self = shared_from_this()](beast::error_code error, std::size_t) {
                            self->is_waiting_ = false;
                            self->on_header(error);
                          });
}

void HttpConnection::on_header(beast::error_code error) {
  if (error == http::error::header_limit) {
    has_unread_body_ = true;
    request_.keep_alive(false);
    return reply(431, "text/plain", "headers are longer than the console takes: 16 kB\n");
  }
  if (is_malformed(error)) {
    has_unread_body_ = true;
    request_.keep_alive(false);
    return reply(400, "text/plain", "not a request of HTTP/1.1\n");
  }
  if (error) return;  // gone
  request_.base() = parser_->get().base();
  if (request_.method() != http::verb::post || method() != kStop) return read_body();
  has_unread_body_ = !parser_->is_done();
  if (admit()) await_stop_body();
}

void HttpConnection::read_body() {
  const auto length = parser_->content_length();
  if (length && *length > kMaxBody) return on_body(http::error::body_limit);
  parser_->body_limit(kMaxBody);
  http::async_read(
      transport_, buffer_, *parser_,
      [self = shared_from_this()](beast::error_code failure, std::size_t) { self->on_body(failure); });
}

void HttpConnection::on_body(beast::error_code error) {
  if (error == http::error::body_limit) {
    has_unread_body_ = true;
    request_.keep_alive(false);
    return reply(413, "text/plain", "larger than the console takes: 256 kB\n");
  }
  if (error) return;  // gone
  request_ = parser_->release();
  if (admit()) handle();
}

std::string_view HttpConnection::header(http::field name) const {
  return text_of(request_[name]);
}

std::string_view HttpConnection::header(const char* name) const {
  return text_of(request_[name]);
}

std::string_view HttpConnection::path() const {
  const std::string_view target = text_of(request_.target());
  return target.substr(0, target.find('?'));
}

/// "hapticd.v1.SafetyService/Stop"; empty if the path is not that of a call.
std::string_view HttpConnection::method() const {
  constexpr std::string_view kCalls = "/rpc/";
  return path().starts_with(kCalls) ? path().substr(kCalls.size()) : std::string_view();
}

ConsoleShared::Who HttpConnection::find_session() {
  if (transport_.has_tls()) return by_certificate_;
  const std::string_view cookie = cookie_value(header(http::field::cookie), shared_->cookie);
  return cookie.empty() ? nullptr : shared_->sign_in.session_of(cookie, find_user());
}

SignIn::User HttpConnection::find_user() {
  if (!user_) {
    beast::error_code error;
    const auto& socket = transport_.next_layer().socket();
    const auto other = socket.remote_endpoint(error);
    const auto own = error ? other : socket.local_endpoint(error);
    user_.emplace(error ? SignIn::User{} : user_of_connection(other, own));
  }
  return *user_;
}

std::string HttpConnection::peer() const {
  beast::error_code error;
  const auto end = transport_.next_layer().socket().remote_endpoint(error);
  if (error) return "unknown";
  return fmt::format("{}:{}", end.address().to_string(), end.port());
}

bool HttpConnection::admit() {
  const RequestGuard& guard = transport_.has_tls() ? shared_->tls_guard : shared_->plain_guard;
  const RequestOrigin from{header(http::field::host), header(http::field::origin), header("Sec-Fetch-Site"),
                           header(http::field::content_type), header("X-Hapticd")};
  auto refusal = guard.check(from);
  if (!refusal && request_.method() == http::verb::post) refusal = guard.check_post(from);
  if (!refusal && request_.method() == http::verb::get && path() == "/live")
    refusal = guard.check_socket(from);
  if (refusal) {
    spdlog::debug("{}: {}", peer(), refusal->why);
    refuse(refusal->http_status, refusal->why);
    return false;
  }
  session_ = find_session();
  if (!shared_->may_ask(session_) && method() != kStop) {
    refuse(429, "too many requests; wait a second");
    return false;
  }
  // The stylesheet has no secret, and the page that says how to sign in needs it.
  if (session_ || path() == "/console.css" || path() == "/open") return true;
  refuse(401,
         transport_.has_tls()
             ? "This browser's certificate has no name of a person (spiffe://LAB/hapticd/ROLE/NAME)."
             : "This browser is not signed in. Run on the rig's machine: hapticctl console. It opens the "
               "console here with a key that works once.");
  return false;
}

void HttpConnection::handle() {
  const bool is_get = request_.method() == http::verb::get || request_.method() == http::verb::head;
  const bool is_post = request_.method() == http::verb::post;
  if (!is_get && !is_post) return refuse(405, "GET and POST only");
  if (is_get && path() == "/open") {
    const std::string_view target = text_of(request_.target());
    return sign_in(target.substr(std::min(target.size(), path().size() + 1)));
  }
  if (request_.method() == http::verb::get && path() == "/live") return become_socket();
  if (is_post && !method().empty()) return serve_rpc(method());
  if (is_get) return serve_file(path());
  refuse(404, "there is nothing here");
}

void HttpConnection::await_stop_body() {
  stop_is_sent_ = false;
  const auto length = parser_->content_length();
  if (!has_unread_body_ || (length && *length > kMaxStopBody)) return send_stop();
  parser_->body_limit(kMaxStopBody);
  is_reading_body_ = true;
  http::async_read(transport_, buffer_, *parser_,
                   [self = shared_from_this()](beast::error_code, std::size_t) {
                     self->is_reading_body_ = false;
                     self->send_stop();
                   });
  stop_timer_.expires_after(kStopBodyTime);
  stop_timer_.async_wait([self = shared_from_this()](beast::error_code aborted) {
    if (!aborted) self->send_stop();
  });
}

void HttpConnection::send_stop() {
  if (std::exchange(stop_is_sent_, true)) return;
  stop_timer_.cancel();
  has_unread_body_ = !parser_->is_done();
  if (has_unread_body_) request_.keep_alive(false);
  Caller caller = shared_->caller_of(*session_, peer());
  caller.lease = header("X-Hapticd-Lease");
  stop(shared_->stop_bridge, shared_->stop_port, caller, {parser_->get().body(), parser_->is_done()},
       [self = shared_from_this(), post = shared_->post](RpcEnd end) {
         post([self, end = std::move(end)]() mutable {
           self->reply(end.http_status, "application/json", std::move(end.json));
         });
       });
}

void HttpConnection::serve_file(std::string_view path) {
  const PageFile* file = page_file_at(path);
  if (file == nullptr) return refuse(404, "there is no such page");
  const std::string tag = tag_of(*file);
  const bool known = header(http::field::if_none_match) == tag;
  Response response = make(known ? 304 : 200, content_type_of(file->name));
  response.set(http::field::etag, tag);
  response.set(http::field::cache_control, "no-cache");  // ask whether it is still the same
  if (!known) response.body() = file->text;
  send(std::move(response));
}

void HttpConnection::sign_in(std::string_view query) {
  constexpr std::string_view kKey = "key=";
  const std::string key(query.starts_with(kKey) ? query.substr(kKey.size()) : std::string_view());
  if (transport_.has_tls() || !is_token(key)) return refuse_key();
  if (shared_->options.is_personal) {
    if (key != shared_->own_key) return refuse_key();
    shared_->own_key.clear();
    return sign_in_as("yourself");
  }
  v1::RedeemConsoleKeyRequest request;
  request.set_key(key);
  shared_->bridge.call_raw(kRedeemPath, request.SerializeAsString(), {},
                           [self = shared_from_this(), post = shared_->post](const grpc::Status& status,
                                                                             const std::string& bytes) {
                             v1::RedeemConsoleKeyResponse answer;
                             const bool is_known = status.ok() && answer.ParseFromString(bytes) &&
                                                   is_metadata_value(answer.identity());
                             post([self, is_known, name = answer.identity()] {
                               is_known ? self->sign_in_as(name) : self->refuse_key();
                             });
                           });
}

void HttpConnection::refuse_key() {
  refuse(401,
         "This address was opened before, or more than a minute ago: it works once. Run hapticctl console "
         "again.");
}

void HttpConnection::sign_in_as(const std::string& name) {
  // Not a redirection: to a page that another one led to, browsers would not show a cookie of this kind.
  Response response = make(200, "text/html; charset=utf-8");
  response.body() =
      "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=/\">"
      "<title>hapticd</title>\n";
  response.set(http::field::set_cookie,
               fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}", shared_->cookie,
                           shared_->sign_in.cookie_for(name, find_user()),
                           static_cast<long long>(shared_->options.session_h * 3600.0)));
  send(std::move(response));
}

void HttpConnection::serve_rpc(std::string_view method) {
  Caller caller = shared_->caller_of(*session_, peer());
  caller.lease = header("X-Hapticd-Lease");
  shared_->bridge.call(method, request_.body(), caller,
                       [self = shared_from_this(), post = shared_->post](RpcEnd end) {
                         post([self, end = std::move(end)]() mutable {
                           self->reply(end.http_status, "application/json", std::move(end.json));
                         });
                       });
}

void HttpConnection::become_socket() {
  if (!beast::websocket::is_upgrade(request_)) return refuse(426, "/live is a WebSocket");
  if (!shared_->watch->daemon_is_there()) return refuse(503, "the daemon does not answer");
  Caller caller = shared_->caller_of(*session_, peer());
  if (!shared_->make_place_for(caller.name)) return refuse(503, "too many pages are open: max_sockets");
  transport_.next_layer().expires_never();
  SocketSession::begin(std::move(transport_), std::move(request_), shared_, std::move(caller));
}

void HttpConnection::refuse(unsigned status, const std::string& why) {
  if (status >= 400 && status != 401 && status != 404) request_.keep_alive(false);
  if (request_.method() == http::verb::post) {
    const grpc::StatusCode code = status == 401   ? grpc::StatusCode::UNAUTHENTICATED
                                  : status == 404 ? grpc::StatusCode::UNIMPLEMENTED
                                  : status == 429 ? grpc::StatusCode::RESOURCE_EXHAUSTED
                                                  : grpc::StatusCode::PERMISSION_DENIED;
    return reply(status, "application/json", refuse_rpc(code, detail_of(why, "console")).json);
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
  if (request_.method() == http::verb::head) {  // only how long it would be
    const std::size_t length = response.body().size();
    response.body().clear();
    response.content_length(length);
  }
  if (has_unread_body_) response.keep_alive(false);
  const auto kept = std::make_shared<Response>(std::move(response));
  transport_.next_layer().expires_after(kWriteTime);
  http::async_write(
      transport_, *kept, [self = shared_from_this(), kept](beast::error_code error, std::size_t) {
        if (error) return;
        if (kept->keep_alive()) return self->read();
        self->transport_.next_layer().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
        if (self->has_unread_body_ && !self->is_reading_body_) self->drain();
      });
}

void HttpConnection::drain() {
  forgotten_.resize(kMaxHeader);
  left_to_forget_ = kMaxDrained;
  transport_.next_layer().expires_after(kDrainTime);
  read_and_forget();
}

void HttpConnection::read_and_forget() {
  transport_.async_read_some(boost::asio::mutable_buffers_1(forgotten_.data(), forgotten_.size()),
                             [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
                               if (error || bytes >= self->left_to_forget_) return;
                               self->left_to_forget_ -= bytes;
                               self->read_and_forget();
                             });
}

}  // namespace hapticd::console
