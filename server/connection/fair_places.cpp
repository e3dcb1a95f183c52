#include "server/connection/fair_places.h"

#include <netinet/in.h>

#include <cstring>

namespace hapticd::server {

std::uint64_t client_of(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) return reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr;
  std::uint64_t network = 0;
  std::memcpy(&network, &reinterpret_cast<const sockaddr_in6&>(address).sin6_addr, sizeof network);
  return network;
}

}  // namespace hapticd::server
