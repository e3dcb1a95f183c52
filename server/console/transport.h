#pragma once

#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>  // before Boost.Asio 1.74, which forgets it

namespace hapticd::server {

/// A connection, with or without TLS: one type, so that what is built on it is compiled once.
class Transport {
 public:
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  explicit Transport(boost::asio::ip::tcp::socket socket)
      : tcp_(std::make_unique<boost::beast::tcp_stream>(std::move(socket))) {}
  /// `context` must outlive it.
  void use_tls(std::shared_ptr<boost::asio::ssl::context> context) {
    context_ = std::move(context);
    tls_ = std::make_unique<Tls>(*tcp_, *context_);
  }

  next_layer_type& next_layer() { return *tcp_; }
  const next_layer_type& next_layer() const { return *tcp_; }
  executor_type get_executor() noexcept { return tcp_->get_executor(); }
  bool has_tls() const { return tls_ != nullptr; }
  SSL* ssl() { return tls_->native_handle(); }

  template <class Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server, std::forward<Handler>(handler));
  }
  template <class Handler>
  void async_shutdown(Handler&& handler) {
    tls_->async_shutdown(std::forward<Handler>(handler));
  }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_read_some(buffers, std::forward<Handler>(handler));
    return tcp_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_write_some(buffers, std::forward<Handler>(handler));
    return tcp_->async_write_some(buffers, std::forward<Handler>(handler));
  }

 private:
  using Tls = boost::asio::ssl::stream<boost::beast::tcp_stream&>;
  std::unique_ptr<boost::beast::tcp_stream> tcp_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::unique_ptr<Tls> tls_;
};

/// How a WebSocket ends the connection below it: found by its argument.
template <class Handler>
void async_teardown(boost::beast::role_type role, Transport& transport, Handler&& handler) {
  // Without a last word of TLS: the WebSocket has said its own.
  boost::beast::websocket::async_teardown(role, transport.next_layer().socket(),
                                          std::forward<Handler>(handler));
}

}  // namespace hapticd::server
