#include "client/console/socket/transport.h"

#include <boost/asio/ssl/stream.hpp>

namespace hapticd::console {

class Transport::Tls : public boost::asio::ssl::stream<boost::beast::tcp_stream&> {
 public:
  using boost::asio::ssl::stream<boost::beast::tcp_stream&>::stream;
};

Transport::Transport(boost::asio::ip::tcp::socket socket)
    : tcp_(std::make_unique<boost::beast::tcp_stream>(std::move(socket))) {}

Transport::Transport(Transport&& other) noexcept = default;
Transport& Transport::operator=(Transport&& other) noexcept = default;
Transport::~Transport() = default;

void Transport::use_tls(std::shared_ptr<boost::asio::ssl::context> context) {
  context_ = std::move(context);
  tls_ = std::make_unique<Tls>(*tcp_, *context_);
}

SSL* Transport::ssl() {
  return tls_->native_handle();
}

void Transport::shake_hands(TransferHandler handler) {
  tls_->async_handshake(
      boost::asio::ssl::stream_base::server,
      [handler = std::move(handler)](boost::beast::error_code error) mutable { handler(error, 0); });
}

void Transport::read_some(const Buffers<boost::asio::mutable_buffer>& buffers, TransferHandler handler) {
  if (tls_) return tls_->async_read_some(buffers, std::move(handler));
  tcp_->async_read_some(buffers, std::move(handler));
}

void Transport::write_some(const Buffers<boost::asio::const_buffer>& buffers, TransferHandler handler) {
  if (tls_) return tls_->async_write_some(buffers, std::move(handler));
  tcp_->async_write_some(buffers, std::move(handler));
}

}  // namespace hapticd::console
