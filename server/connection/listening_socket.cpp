#include "server/connection/listening_socket.h"

#include <netdb.h>
#include <netinet/tcp.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace hapticd::server {

void set_port(SocketAddress& address, std::uint16_t port) {
  if (address.bytes.ss_family == AF_INET) {
    reinterpret_cast<sockaddr_in&>(address.bytes).sin_port = htons(port);
  } else {
    reinterpret_cast<sockaddr_in6&>(address.bytes).sin6_port = htons(port);
  }
}

std::uint16_t port_of(int descriptor) {
  SocketAddress own;
  own.length = sizeof own.bytes;
  getsockname(descriptor, own.any(), &own.length);
  const bool v4 = own.bytes.ss_family == AF_INET;
  return ntohs(v4 ? reinterpret_cast<sockaddr_in&>(own.bytes).sin_port
                  : reinterpret_cast<sockaddr_in6&>(own.bytes).sin6_port);
}

std::vector<SocketAddress> addresses_of(const ListenAddress& listen, std::string& reason) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int failure =
          getaddrinfo(listen.host.c_str(), std::to_string(listen.port).c_str(), &hints, &found);
      failure != 0) {
    reason = gai_strerror(failure);
    return {};
  }
  std::vector<SocketAddress> all;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    SocketAddress& address = all.emplace_back();
    std::memcpy(&address.bytes, one->ai_addr, one->ai_addrlen);
    address.length = one->ai_addrlen;
  }
  freeaddrinfo(found);
  return all;
}

int listen_at(SocketAddress address) {
  const int family = address.bytes.ss_family;
  const int descriptor = socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return -1;
  const int on = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // those accepted inherit it
  if (family == AF_INET6) setsockopt(descriptor, IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof on);
  if (bind(descriptor, address.any(), address.length) == 0 && ::listen(descriptor, SOMAXCONN) == 0) {
    return descriptor;
  }
  const int reason = errno;
  close(descriptor);
  errno = reason;
  return -1;
}

}  // namespace hapticd::server
