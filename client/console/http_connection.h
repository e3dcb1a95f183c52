#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/console/console_shared.h"
#include "client/console/socket/transport.h"

namespace hapticd::console {

/// A connection of a browser: files of the page, calls, and the change to a socket. A stop is sent to the
/// daemon as soon as its header is read and its body has come, or has not come within milliseconds. Used by
/// the console's thread alone; lives as long as something of it is under way.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Transport transport, std::shared_ptr<ConsoleShared> shared);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void start();
  /// True while it waits for a request of a browser that is not signed in: it goes first if there are too
  /// many.
  bool is_strange() const { return is_waiting_ && !session_; }
  bool is_idle() const { return is_waiting_; }
  void close();

 private:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;

  void shake_hands();
  void read();
  void on_header(boost::beast::error_code error);
  void read_body();
  void on_body(boost::beast::error_code error);
  /// True if the request may be made; if not, it has been refused.
  bool admit();
  void handle();
  void serve_file(std::string_view path);
  void serve_rpc(std::string_view method);
  void await_stop_body();
  void send_stop();
  void sign_in(std::string_view query);
  void sign_in_as(const std::string& name);
  void refuse_key();
  void become_socket();
  /// Refuses with a page in words for people, or JSON for the page's own requests.
  void refuse(unsigned status, const std::string& why);
  void reply(unsigned status, std::string_view type, std::string body);
  void send(Response response);
  /// Reads what is left of a request that was answered before its end: else the answer is lost with it.
  void drain();
  void read_and_forget();
  Response make(unsigned status, std::string_view type) const;
  ConsoleShared::Who find_session();
  SignIn::User find_user();
  std::string peer() const;
  std::string_view header(boost::beast::http::field name) const;
  std::string_view header(const char* name) const;
  std::string_view path() const;
  std::string_view method() const;

  Transport transport_;
  const std::shared_ptr<ConsoleShared> shared_;
  boost::asio::steady_timer stop_timer_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  Request request_;             ///< without its body until it is read
  ConsoleShared::Who session_;  ///< of the last request
  ConsoleShared::Who by_certificate_;
  std::optional<SignIn::User> user_;  ///< at the other end, once it was looked up
  bool is_waiting_ = false;
  bool is_reading_body_ = false;
  bool has_unread_body_ = false;
  bool stop_is_sent_ = true;
  std::vector<char> forgotten_;
  std::size_t left_to_forget_ = 0;
};

}  // namespace hapticd::console
