#pragma once

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "client/console/socket/transport.h"

namespace hapticd::console {

/// A WebSocket over a connection. Boost.Beast's operations are compiled with this class alone, and the one
/// that accepts separately, since they are slow to compile. One operation of each kind at a time; a callback
/// that holds the owner keeps it until the operation ends. Used by the console's thread alone.
class WebSocket {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using CloseCode = boost::beast::websocket::close_code;
  using Done = std::function<void(bool is_good)>;
  /// A message; it is not good if the connection has ended or the message is too long. `bytes` last for the
  /// call.
  using Taken = std::function<void(bool is_good, bool is_text, std::string_view bytes)>;

  /// max_message: bytes of the longest one that is read.
  WebSocket(Transport transport, std::size_t max_message);
  ~WebSocket();

  Transport::executor_type executor();
  void accept(Request request, Done done);
  void read(Taken taken);
  /// `bytes` must last until `done`.
  void write(bool is_text, std::string_view bytes, Done done);
  void close(CloseCode code, const std::string& why, std::function<void()> done);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::console
