#include "server/connection/stop_sockets.h"

#include <unistd.h>

#include <utility>

namespace hapticd::server {

StopSockets::StopSockets(StopSockets&& other) noexcept {
  *this = std::move(other);
}

StopSockets& StopSockets::operator=(StopSockets&& other) noexcept {
  if (this == &other) return *this;
  close_all();
  plain = std::exchange(other.plain, {});
  tls = std::exchange(other.tls, {});
  datagram = std::exchange(other.datagram, -1);
  datagram_path = std::exchange(other.datagram_path, {});
  return *this;
}

StopSockets::~StopSockets() {
  close_all();
}

void StopSockets::close_all() noexcept {
  for (const int descriptor : plain) close(descriptor);
  for (const int descriptor : tls) close(descriptor);
  if (datagram >= 0) close(datagram);
  if (!datagram_path.empty()) unlink(datagram_path.c_str());
}

}  // namespace hapticd::server
