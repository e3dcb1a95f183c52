#include "tests/support/http_get.h"

#include <array>

#include "tests/support/system/loopback.h"

namespace hapticd::test {

std::string http_get(std::uint16_t port, const std::string& path) {
  const int descriptor = connect_to_loopback(port);
  std::string answer;
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  std::array<char, 4096> part{};
  if (send(descriptor, request.data(), request.size(), MSG_NOSIGNAL) ==
      static_cast<ssize_t>(request.size())) {
    for (ssize_t n = 0; (n = recv(descriptor, part.data(), part.size(), 0)) > 0;)
      answer.append(part.data(), static_cast<std::size_t>(n));
  }
  close(descriptor);
  return answer;
}

}  // namespace hapticd::test
