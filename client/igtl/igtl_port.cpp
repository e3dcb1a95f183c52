#include "client/igtl/igtl_port.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace hapticd::igtl_bridge {

namespace {

/// A pose that waits in a socket's buffer is an old one: 60 messages at most.
constexpr int kSendBuffer = 8192;
/// Bytes of a peer in a round: 150 transforms. The bridge makes 200 rounds a second.
constexpr std::size_t kMaxRead = 16384;

std::string words(const char* what) {
  return std::string(what) + ": " + std::strerror(errno);
}

}  // namespace

IgtlPort::IgtlPort(const std::string& host, std::uint16_t port, HeaderVersion sent, Handlers handlers)
    : sent_(sent), handlers_(std::move(handlers)) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  const std::string service = std::to_string(port);
  if (const int error = getaddrinfo(host.c_str(), service.c_str(), &wanted, &found); error != 0) {
    throw std::runtime_error(host + " is not an address: " + gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, freeaddrinfo);
  listener_ = socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;
  if (listener_ >= 0) setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (listener_ < 0 || bind(listener_, found->ai_addr, found->ai_addrlen) != 0 ||
      listen(listener_, SOMAXCONN) != 0) {
    const std::string reason = words((host + ":" + service + " cannot be listened on").c_str());
    if (listener_ >= 0) close(listener_);
    throw std::runtime_error(reason);
  }
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  getsockname(listener_, reinterpret_cast<sockaddr*>(&bound), &size);
  port_ = ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6*>(&bound)->sin6_port
                                            : reinterpret_cast<const sockaddr_in*>(&bound)->sin_port);
}

IgtlPort::~IgtlPort() {
  for (const Peer& peer : peers_) close(peer.descriptor);
  close(listener_);
}

void IgtlPort::accept_peers() {
  for (int round = 0; round < kMaxPeers; ++round) {
    sockaddr_storage from{};
    socklen_t size = sizeof from;
    const int descriptor =
        accept4(listener_, reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor < 0) return;
    std::array<char, NI_MAXHOST> host{};
    getnameinfo(reinterpret_cast<const sockaddr*>(&from), size, host.data(), host.size(), nullptr, 0,
                NI_NUMERICHOST);
    if (peers_.size() >= kMaxPeers && !make_room_for(host.data())) {
      if (!std::exchange(refused_, true)) {
        handlers_.on_note(std::string(host.data()) + " was refused: " + std::to_string(kMaxPeers) +
                          " peers are connected");
      }
      close(descriptor);
      continue;
    }
    const int yes = 1;
    setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
    peers_.emplace_back();
    peers_.back().descriptor = descriptor;
    peers_.back().name = host.data();
    handlers_.on_note(peers_.back().name + " has connected");
  }
}

bool IgtlPort::make_room_for(const std::string& host) {
  const auto count = [this](const std::string& name) {
    return std::count_if(peers_.begin(), peers_.end(),
                         [&name](const Peer& peer) { return !peer.gone && peer.name == name; });
  };
  Peer* oldest_of_most = nullptr;
  for (Peer& peer : peers_) {
    if (peer.gone) continue;
    if (oldest_of_most == nullptr || count(peer.name) > count(oldest_of_most->name)) oldest_of_most = &peer;
  }
  if (oldest_of_most == nullptr || count(oldest_of_most->name) <= count(host) + 1) return false;
  oldest_of_most->gone = true;
  return true;
}

void IgtlPort::read_from(Peer& peer) {
  // Once a round: a peer that sends without end keeps neither the others nor the end of the program waiting.
  std::array<std::uint8_t, kMaxRead> bytes{};
  const ssize_t count = recv(peer.descriptor, bytes.data(), bytes.size(), 0);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (count <= 0) {
    peer.gone = true;
    return;
  }
  peer.reader.add(bytes.data(), static_cast<std::size_t>(count));
  while (!peer.gone) {
    switch (peer.reader.next()) {
      case MessageReader::Event::kNothing:
        return;
      case MessageReader::Event::kTransform:
        handlers_.on_transform(peer.reader.transform());
        break;
      case MessageReader::Event::kOther:
        break;
      case MessageReader::Event::kBroken:
        // A peer sends the same again and again: the first of each kind says enough.
        if (peer.problems.size() < kMaxProblems && peer.problems.insert(peer.reader.problem()).second) {
          handlers_.on_note(peer.name + ", '" + peer.reader.transform().name + "': " + peer.reader.problem());
        }
        break;
      case MessageReader::Event::kUnreadable:
        handlers_.on_note(peer.name + ": " + peer.reader.problem());
        peer.gone = true;
        break;
    }
  }
}

bool IgtlPort::write_rest(Peer& peer) {
  while (!peer.rest.empty()) {
    const ssize_t count = ::send(peer.descriptor, peer.rest.data(), peer.rest.size(), MSG_NOSIGNAL);
    if (count < 0) {
      if (errno != EAGAIN && errno != EINTR) peer.gone = true;
      return false;
    }
    peer.rest.erase(peer.rest.begin(), peer.rest.begin() + count);
  }
  return true;
}

Packed IgtlPort::bytes_for(Peer& peer, const Message& message) const {
  const bool is_version_2 =
      sent_ == HeaderVersion::k2 || (sent_ == HeaderVersion::kAsThePeer && peer.reader.version() > 1);
  return is_version_2 ? with_version_2(message, ++peer.sent_with_version_2) : message.packed;
}

void IgtlPort::send(const Message& message) {
  for (Peer& peer : peers_) {
    if (peer.gone) continue;
    if (!write_rest(peer)) {
      ++skipped_;
      continue;
    }
    peer.rest = bytes_for(peer, message);
    write_rest(peer);
  }
}

void IgtlPort::serve() {
  accept_peers();
  for (Peer& peer : peers_) {
    if (!peer.gone) read_from(peer);
  }
  for (auto peer = peers_.begin(); peer != peers_.end();) {
    if (!peer->gone) {
      ++peer;
      continue;
    }
    handlers_.on_note(peer->name + " has gone");
    refused_ = false;
    close(peer->descriptor);
    peer = peers_.erase(peer);
  }
}

}  // namespace hapticd::igtl_bridge
