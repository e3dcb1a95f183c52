#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/console/console_shared.h"
#include "server/console/transport.h"

namespace hapticd::server {

/// A connection of a browser: files of the page, calls, and the change to a socket. Used by the console's
/// thread alone; lives as long as something of it is under way.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Transport transport, std::shared_ptr<ConsoleShared> shared);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void start();
  /// Waits for a request, and no one is known behind it: it goes first where there are too many.
  bool is_strange() const { return is_waiting_ && !session_; }
  bool is_idle() const { return is_waiting_; }
  void close();

 private:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;

  void shake_hands();
  void read();
  void on_read(boost::beast::error_code error);
  void handle();
  void serve_file(std::string_view path);
  void serve_rpc(std::string_view method);
  void sign_in(std::string_view query);
  void become_socket();
  /// A page in words for people, or JSON for the page's own requests.
  void refuse(unsigned status, const std::string& why);
  void reply(unsigned status, std::string_view type, std::string body);
  void send(Response response);
  Response make(unsigned status, std::string_view type) const;
  ConsoleShared::Session find_session() const;
  std::string peer() const;
  std::string_view header(boost::beast::http::field name) const;
  std::string_view header(const char* name) const;

  Transport transport_;
  const std::shared_ptr<ConsoleShared> shared_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  Request request_;
  ConsoleShared::Session session_;  ///< of the last request
  ConsoleShared::Session by_certificate_;
  bool is_denied_ = false;
  bool is_waiting_ = false;
  std::string denied_why_;
};

}  // namespace hapticd::server
