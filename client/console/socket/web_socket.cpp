#include "client/console/socket/web_socket.h"

#include <chrono>
#include <utility>

#include "client/console/socket/web_socket_state.h"

namespace hapticd::console {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

WebSocket::WebSocket(Transport transport, std::size_t max_message)
    : state_(std::make_unique<State>(std::move(transport))) {
  websocket::stream_base::timeout limits{};
  limits.handshake_timeout = std::chrono::seconds(5);
  limits.idle_timeout = std::chrono::seconds(20);
  limits.keep_alive_pings = true;
  state_->stream.set_option(limits);
  state_->stream.read_message_max(max_message);
}

WebSocket::~WebSocket() = default;

Transport::executor_type WebSocket::executor() {
  return state_->stream.get_executor();
}

void WebSocket::read(Taken taken) {
  state_->stream.async_read(
      state_->buffer, [state = state_.get(), taken = std::move(taken)](beast::error_code error, std::size_t) {
        if (error) return taken(false, false, {});
        const auto data = state->buffer.cdata();
        const std::string message(static_cast<const char*>(data.data()), data.size());
        state->buffer.consume(state->buffer.size());
        taken(true, state->stream.got_text(), message);
      });
}

void WebSocket::write(bool is_text, std::string_view bytes, Done done) {
  state_->stream.text(is_text);
  state_->stream.async_write(
      boost::asio::buffer(bytes.data(), bytes.size()),
      [done = std::move(done)](beast::error_code error, std::size_t) { done(!error); });
}

void WebSocket::close(CloseCode code, const std::string& why, std::function<void()> done) {
  state_->stream.async_close({code, why}, [done = std::move(done)](beast::error_code) { done(); });
}

}  // namespace hapticd::console
