#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <utility>

#include "client/console/socket/web_socket.h"

namespace hapticd::console {

/// Boost.Beast's half of a WebSocket, for the files that compile its operations.
struct WebSocket::State {
  explicit State(Transport transport) : stream(std::move(transport)) {}
  boost::beast::websocket::stream<Transport, false> stream;
  boost::beast::flat_buffer buffer;
};

}  // namespace hapticd::console
