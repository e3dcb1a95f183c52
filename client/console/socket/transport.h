#pragma once

#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <memory>
#include <utility>  // before Boost.Asio 1.74, which forgets it

namespace hapticd::console {

/// The handler of one transfer or of one step of TLS. It hides the handler's type, so that TLS and the socket
/// below Boost.Beast's operations are compiled once and not once for each operation.
class TransferHandler {
 public:
  template <class Handler>
  explicit TransferHandler(Handler handler) : held_(std::make_unique<Held<Handler>>(std::move(handler))) {}
  void operator()(boost::beast::error_code error, std::size_t bytes) { held_->call(error, bytes); }

 private:
  struct Base {
    virtual ~Base() = default;
    virtual void call(boost::beast::error_code error, std::size_t bytes) = 0;
  };
  template <class Handler>
  struct Held final : Base {
    explicit Held(Handler h) : handler(std::move(h)) {}
    void call(boost::beast::error_code error, std::size_t bytes) override { handler(error, bytes); }
    Handler handler;
  };
  std::unique_ptr<Base> held_;
};

/// A connection, with or without TLS: one type, so that what is built on it is compiled once.
class Transport {
 public:
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  explicit Transport(boost::asio::ip::tcp::socket socket);
  Transport(Transport&& other) noexcept;
  Transport& operator=(Transport&& other) noexcept;
  ~Transport();
  void use_tls(std::shared_ptr<boost::asio::ssl::context> context);

  next_layer_type& next_layer() { return *tcp_; }
  const next_layer_type& next_layer() const { return *tcp_; }
  executor_type get_executor() noexcept { return tcp_->get_executor(); }
  bool has_tls() const { return tls_ != nullptr; }
  SSL* ssl();

  /// Shakes hands as a server; `handler(error)`.
  template <class Handler>
  void async_handshake(Handler handler) {
    shake_hands(TransferHandler([handler = std::move(handler)](boost::beast::error_code error,
                                                               std::size_t) mutable { handler(error); }));
  }
  template <class Sequence, class Handler>
  void async_read_some(const Sequence& buffers, Handler&& handler) {
    read_some(first_of<boost::asio::mutable_buffer>(buffers),
              TransferHandler(std::forward<Handler>(handler)));
  }
  template <class Sequence, class Handler>
  void async_write_some(const Sequence& buffers, Handler&& handler) {
    write_some(first_of<boost::asio::const_buffer>(buffers), TransferHandler(std::forward<Handler>(handler)));
  }

 private:
  class Tls;
  static constexpr std::size_t kMaxBuffers = 16;  ///< of one transfer; the caller comes back for the others
  template <class Buffer>
  using Buffers = boost::container::static_vector<Buffer, kMaxBuffers>;

  template <class Buffer, class Sequence>
  static Buffers<Buffer> first_of(const Sequence& sequence) {
    Buffers<Buffer> first;
    const auto end = boost::asio::buffer_sequence_end(sequence);
    for (auto at = boost::asio::buffer_sequence_begin(sequence); at != end && first.size() < kMaxBuffers;
         ++at) {
      const Buffer buffer = *at;
      if (buffer.size() > 0) first.push_back(buffer);
    }
    return first;
  }
  void shake_hands(TransferHandler handler);
  void read_some(const Buffers<boost::asio::mutable_buffer>& buffers, TransferHandler handler);
  void write_some(const Buffers<boost::asio::const_buffer>& buffers, TransferHandler handler);

  std::unique_ptr<boost::beast::tcp_stream> tcp_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::unique_ptr<Tls> tls_;
};

/// Ends the TCP connection below a WebSocket; Boost.Beast finds it by its argument. TLS gets no last message:
/// the WebSocket has sent one.
template <class Handler>
void async_teardown(boost::beast::role_type role, Transport& transport, Handler&& handler) {
  boost::beast::websocket::async_teardown(role, transport.next_layer().socket(),
                                          std::forward<Handler>(handler));
}

}  // namespace hapticd::console
