#include <memory>
#include <utility>

#include "client/console/socket/web_socket_state.h"

namespace hapticd::console {

void WebSocket::accept(Request request, Done done) {
  const auto kept = std::make_shared<Request>(std::move(request));
  state_->stream.async_accept(
      *kept, [done = std::move(done), kept](boost::beast::error_code error) { done(!error); });
}

}  // namespace hapticd::console
