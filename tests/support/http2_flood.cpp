#include "tests/support/http2_flood.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <stdexcept>

namespace hapticd::test {

namespace {

// RFC 9113, section 4.1.
std::string frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload) {
  const auto size = static_cast<std::uint32_t>(payload.size());
  std::string bytes;
  for (const unsigned shift : {16U, 8U, 0U}) bytes += static_cast<char>((size >> shift) & 0xFFU);
  bytes += static_cast<char>(type);
  bytes += static_cast<char>(flags);
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>((stream >> shift) & 0xFFU);
  return bytes + payload;
}

std::string text(const std::string& value) {  // RFC 7541, 5.2, plain and short
  return static_cast<char>(value.size()) + value;
}

}  // namespace

Http2Flood::Http2Flood(const std::string& address) : authority_(address) {
  const std::size_t colon = address.rfind(':');
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  peer.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &peer.sin_addr);
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) != 0) {
    throw std::runtime_error("no one listens on " + address);
  }
  send_all("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "") + frame(4, 1, 0, ""));
}

Http2Flood::~Http2Flood() {
  close(socket_);
}

int Http2Flood::open_and_reset(const std::string& method, int streams) {
  // :method POST, :scheme http, :path, :authority, content-type, te: trailers; nothing of it indexed.
  const std::string headers = std::string("\x83\x86\x04", 3) + text(method) + "\x01" + text(authority_) +
                              "\x0f\x10" + text("application/grpc") + std::string(1, '\0') + text("te") +
                              text("trailers");
  const std::string empty_message(5, '\0');
  for (int sent = 0; sent < streams; ++sent) {
    const unsigned stream = next_stream_;
    next_stream_ += 2;
    const std::string bytes = frame(1, 0x4, stream, headers) + frame(0, 0x1, stream, empty_message) +
                              frame(3, 0, stream, std::string("\0\0\0\x08", 4));  // CANCEL
    if (!send_all(bytes)) return sent;
    if (sent % 64 == 0) discard_what_came();
  }
  return streams;
}

bool Http2Flood::send_all(const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (n <= 0) return false;
    at += static_cast<std::size_t>(n);
  }
  return true;
}

void Http2Flood::discard_what_came() {
  char bytes[65536];
  while (recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT) > 0) {
  }
}

}  // namespace hapticd::test
