#include "tests/support/http2_flood.h"

#include <openssl/ssl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "tests/support/system/loopback.h"

namespace hapticd::test {

namespace {

constexpr int kPieceBytes = 16'384;

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

Http2Flood::Http2Flood(const std::string& address, const std::string& certificates)
    : authority_("localhost") {
  connect_to(address);
  if (address.starts_with("tls:")) begin_tls(certificates);
  send_all("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "") + frame(4, 1, 0, ""));
}

Http2Flood::~Http2Flood() {
  SSL_free(tls_);
  SSL_CTX_free(context_);
  close(socket_);
}

void Http2Flood::connect_to(const std::string& address) {
  constexpr std::string_view kUnix = "unix:";
  bool is_connected = false;
  if (address.starts_with(kUnix)) {
    sockaddr_un peer{};
    peer.sun_family = AF_UNIX;
    std::strncpy(peer.sun_path, address.c_str() + kUnix.size(), sizeof peer.sun_path - 1);
    socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    is_connected = connect(socket_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) == 0;
  } else {
    socket_ = connect_to_loopback(std::stoi(address.substr(address.rfind(':') + 1)));
    is_connected = socket_ >= 0;
  }
  if (!is_connected) throw std::runtime_error("no one listens on " + address);
}

void Http2Flood::begin_tls(const std::string& certificates) {
  signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to what may be closed
  constexpr unsigned char kHttp2[] = {2, 'h', '2'};
  context_ = SSL_CTX_new(TLS_client_method());
  SSL_CTX_load_verify_locations(context_, (certificates + "/authority.crt").c_str(), nullptr);
  SSL_CTX_use_certificate_chain_file(context_, (certificates + "/client.crt").c_str());
  SSL_CTX_use_PrivateKey_file(context_, (certificates + "/client.key").c_str(), SSL_FILETYPE_PEM);
  tls_ = SSL_new(context_);
  SSL_set_fd(tls_, socket_);
  SSL_set_alpn_protos(tls_, kHttp2, sizeof kHttp2);
  if (SSL_connect(tls_) != 1) throw std::runtime_error("no encrypted connection comes about");
}

std::string Http2Flood::headers_of(const std::string& method) const {
  // :method POST, :scheme http, :path, :authority, content-type, te: trailers; nothing of it indexed.
  return std::string("\x83\x86\x04", 3) + text(method) + "\x01" + text(authority_) + "\x0f\x10" +
         text("application/grpc") + std::string(1, '\0') + text("te") + text("trailers");
}

int Http2Flood::open_and_reset(const std::string& method, int streams) {
  const std::string headers = headers_of(method);
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

long Http2Flood::send_endless_header(long bytes) {
  // A text of 2^30 bytes without an index: its name is index 0, its length in 7 bits and continuations.
  const std::string begin("\x00\x7f\x81\xff\xff\xff\x03", 7);
  const unsigned stream = next_stream_;
  next_stream_ += 2;
  if (!send_all(frame(1, 0, stream, begin))) return 0;
  const std::string piece = frame(9, 0, stream, std::string(kPieceBytes, 'a'));
  long sent = 0;
  while (sent < bytes && send_all(piece)) {
    sent += kPieceBytes;
    discard_what_came();
  }
  return sent;
}

int Http2Flood::open_unfinished(const std::string& method, int calls, int bytes) {
  const std::string headers = headers_of(method);
  for (int opened = 0; opened < calls; ++opened) {
    const unsigned stream = next_stream_;
    next_stream_ += 2;
    std::string message("\0\0\x0f\xff\xff", 5);  // it claims almost a mebibyte
    message.append(static_cast<std::size_t>(bytes), 'x');
    if (!send_all(frame(1, 0x4, stream, headers) + frame(0, 0, stream, message))) return opened;
    discard_what_came();
  }
  return calls;
}

int Http2Flood::open_unread(const std::string& method, int calls, const std::string& request,
                            bool is_finished) {
  send_all(frame(4, 0, 0, std::string("\0\x04\0\0\0\0", 6)));  // SETTINGS_INITIAL_WINDOW_SIZE: 0
  const std::string headers = headers_of(method);
  const std::string message = std::string(4, '\0') + text(request);
  for (int opened = 0; opened < calls; ++opened) {
    const unsigned stream = next_stream_;
    next_stream_ += 2;
    if (!send_all(frame(1, 0x4, stream, headers) + frame(0, is_finished ? 0x1 : 0, stream, message)))
      return opened;
    discard_what_came();
  }
  return calls;
}

bool Http2Flood::is_closed() {
  discard_what_came();
  return is_closed_;
}

bool Http2Flood::send_all(const std::string& bytes) {
  if (is_closed_) return false;
  if (tls_ != nullptr) {
    is_closed_ = SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size())) <= 0;
    return !is_closed_;
  }
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (n <= 0) {
      is_closed_ = true;
      return false;
    }
    at += static_cast<std::size_t>(n);
  }
  return true;
}

void Http2Flood::discard_what_came() {
  char bytes[65536];
  pollfd watched{socket_, POLLIN, 0};
  while (!is_closed_ && poll(&watched, 1, 0) > 0) {
    const ssize_t n = tls_ != nullptr ? SSL_read(tls_, bytes, sizeof bytes)
                                      : recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (n <= 0) is_closed_ = true;
  }
}

}  // namespace hapticd::test
