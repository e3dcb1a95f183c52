#include "tests/measure/bench/pose/delaying_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <random>
#include <stdexcept>

namespace hapticd::bench {
namespace {

constexpr int kLookMs = 100;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

int tcp_socket() {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) throw std::runtime_error("no socket for the proxy");
  return descriptor;
}

void send_at_once(int descriptor) {
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

bool is_readable(int descriptor) {
  pollfd waiting{descriptor, POLLIN, 0};
  return poll(&waiting, 1, kLookMs) > 0;
}

}  // namespace

DelayingProxy::DelayingProxy(std::uint16_t target_port, WayDelay there, WayDelay back)
    : target_port_(target_port), there_(there), back_(back), listener_(tcp_socket()) {
  sockaddr_in address = loopback(0);
  socklen_t length = sizeof address;
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), length) != 0 || listen(listener_, 8) != 0) {
    throw std::runtime_error("no port for the proxy");
  }
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { serve(); });
}

DelayingProxy::~DelayingProxy() {
  ending_ = true;
  thread_.join();
  close(listener_);
}

void DelayingProxy::serve() {
  while (!ending_) {
    if (!is_readable(listener_)) continue;
    const int near = accept(listener_, nullptr, nullptr);
    if (near < 0) continue;
    const int far = tcp_socket();
    const sockaddr_in address = loopback(target_port_);
    if (connect(far, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      send_at_once(near);
      send_at_once(far);
      std::thread answers([&] { pass_on(far, near, back_); });
      pass_on(near, far, there_);
      shutdown(far, SHUT_RDWR);
      answers.join();
    }
    close(far);
    close(near);
  }
}

void DelayingProxy::pass_on(int from, int to, WayDelay delay) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> more_ms(0.0, delay.more_ms);
  std::array<char, 65536> bytes{};
  while (!ending_) {
    if (!is_readable(from)) continue;
    const ssize_t count = read(from, bytes.data(), bytes.size());
    if (count <= 0) return;
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(delay.least_ms + more_ms(random)));
    for (ssize_t sent = 0; sent < count;) {
      const ssize_t n = send(to, bytes.data() + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
      if (n <= 0) return;
      sent += n;
    }
  }
}

}  // namespace hapticd::bench
