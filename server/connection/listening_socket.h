#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <string>
#include <vector>

#include "server/config/listen_address.h"

namespace hapticd::server {

/// Address of a socket, of any family.
struct SocketAddress {
  sockaddr_storage bytes{};
  socklen_t length = 0;
  sockaddr* any() { return reinterpret_cast<sockaddr*>(&bytes); }
};

/// All addresses of a host; none, with the system's reason, if it has none.
std::vector<SocketAddress> addresses_of(const ListenAddress& listen, std::string& reason);
void set_port(SocketAddress& address, std::uint16_t port);
/// The port to which a socket is bound.
std::uint16_t port_of(int descriptor);
/// Listens over TCP, nothing waits; returns the descriptor, or -1 with the reason in errno.
int listen_at(SocketAddress address);

}  // namespace hapticd::server
