#include "tests/emulators/netft/http_page.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "tests/support/system/loopback.h"

namespace hapticd::emulators {

namespace {

bool send_all(int connection, const std::string& text) {
  std::size_t sent = 0;
  while (sent < text.size()) {
    const ssize_t n = send(connection, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

HttpPage::HttpPage(std::string path, int port) : path_(std::move(path)) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  wake_ = eventfd(0, EFD_CLOEXEC);
  sockaddr_in address = test::loopback(port);
  socklen_t length = sizeof address;
  // A box that comes back answers at its old port, whatever is left of old connections.
  const int on = 1;
  if (listener_ >= 0) setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (listener_ < 0 || wake_ < 0 || bind(listener_, reinterpret_cast<sockaddr*>(&address), length) != 0 ||
      listen(listener_, 8) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    throw std::runtime_error("the page of the emulated box has no socket");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { run(); });
}

HttpPage::~HttpPage() {
  stopping_.store(true);
  eventfd_write(wake_, 1);
  thread_.join();
  close(listener_);
  close(wake_);
}

void HttpPage::set_text(std::string text) {
  const std::lock_guard lock(mutex_);
  text_ = std::move(text);
}

/// False when it is over: the other side has gone, or the server is to end.
bool HttpPage::pause(int connection, int milliseconds) const {
  std::array<pollfd, 2> descriptors{{{connection, POLLRDHUP, 0}, {wake_, POLLIN, 0}}};
  return poll(descriptors.data(), descriptors.size(), milliseconds) == 0;
}

void HttpPage::run() {
  while (!stopping_.load()) {
    std::array<pollfd, 2> descriptors{{{listener_, POLLIN, 0}, {wake_, POLLIN, 0}}};
    if (poll(descriptors.data(), descriptors.size(), -1) <= 0 || (descriptors[0].revents & POLLIN) == 0)
      continue;
    const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    serve(connection);
    close(connection);
  }
}

void HttpPage::serve(int connection) {
  std::string request;
  std::array<char, 1024> bytes{};
  while (request.find("\r\n\r\n") == std::string::npos && request.size() < 16384) {
    std::array<pollfd, 2> descriptors{{{connection, POLLIN, 0}, {wake_, POLLIN, 0}}};
    if (poll(descriptors.data(), descriptors.size(), 10'000) <= 0 || stopping_.load()) return;
    const ssize_t n = recv(connection, bytes.data(), bytes.size(), 0);
    if (n <= 0) return;
    request.append(bytes.data(), static_cast<std::size_t>(n));
  }
  requests_.fetch_add(1);
  switch (manner_.load()) {
    case PageManner::kRefuse:
      return;
    case PageManner::kHang:
      pause(connection, -1);
      return;
    case PageManner::kDrip:
      while (send_all(connection, "H") && pause(connection, 50)) {
      }
      return;
    case PageManner::kEndless:
      send_all(connection, "HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n\r\n");
      while (!stopping_.load() && send_all(connection, std::string(4096, ' '))) {
      }
      return;
    case PageManner::kServe:
    case PageManner::kNotFound:
      break;
  }
  const bool found = manner_.load() == PageManner::kServe && request.starts_with("GET " + path_ + " HTTP/1.");
  std::string body = "no such page";
  if (found) {
    const std::lock_guard lock(mutex_);
    body = text_;
  }
  send_all(connection, std::string(found ? "HTTP/1.1 200 OK" : "HTTP/1.1 404 Not Found") +
                           "\r\nContent-Type: text/xml\r\nConnection: close\r\nContent-Length: " +
                           std::to_string(body.size()) + "\r\n\r\n" + body);
}

}  // namespace hapticd::emulators
