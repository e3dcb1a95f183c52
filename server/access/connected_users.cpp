#include "server/access/connected_users.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <string_view>

#include "server/access/local_user.h"

namespace hapticd::server {

namespace {

/// As gRPC writes it, without its escapes: "ipv4:127.0.0.1:40712", "ipv6:[::1]:40712"; empty for other kinds.
std::string address_of_peer(int descriptor) {
  sockaddr_storage peer{};
  socklen_t length = sizeof peer;
  if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &length) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(peer);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return std::string("ipv4:") + text.data() + ":" + std::to_string(ntohs(v4.sin_port));
  }
  if (peer.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(peer);
  inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  return std::string("ipv6:[") + text.data() + "]:" + std::to_string(ntohs(v6.sin6_port));
}

std::string unescaped(const std::string& peer) {
  std::string text;
  for (std::size_t i = 0; i < peer.size(); ++i) {
    const std::string_view rest = std::string_view(peer).substr(i, 3);
    if (rest == "%5B" || rest == "%5D") {
      text += rest == "%5B" ? '[' : ']';
      i += 2;
    } else {
      text += peer[i];
    }
  }
  return text;
}

}  // namespace

void ConnectedUsers::note(int descriptor) {
  const std::string address = address_of_peer(descriptor);
  if (address.empty()) return;
  const auto id = user_of_loopback_peer(descriptor);
  LocalUser user = id ? look_up(*id) : LocalUser{};
  const std::lock_guard lock(mutex_);
  if (users_.insert_or_assign(address, std::move(user)).second) order_.push_back(address);
  if (order_.size() <= kMax) return;
  users_.erase(order_.front());
  order_.pop_front();
}

// The names may be those of a directory in the network: asking for each connection would take too long.
LocalUser ConnectedUsers::look_up(unsigned id) {
  const auto now = std::chrono::steady_clock::now();
  if (now >= forget_at_) {
    known_.clear();
    forget_at_ = now + kKept;
  }
  const auto known = known_.find(id);
  if (known != known_.end()) return known->second;
  return known_.emplace(id, user_of_id(id)).first->second;
}

LocalUser ConnectedUsers::find(const std::string& peer) const {
  const std::string address = unescaped(peer);
  const std::lock_guard lock(mutex_);
  const auto found = users_.find(address);
  return found == users_.end() ? LocalUser{} : found->second;
}

}  // namespace hapticd::server
