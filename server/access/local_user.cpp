#include "server/access/local_user.h"

#include <grp.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

namespace hapticd::server {

namespace {

constexpr std::size_t kNameBuffer = 16384;

struct Diagnosis {
  nlmsghdr header{};
  inet_diag_req_v2 request{};
};

bool fill_ends(int descriptor, inet_diag_req_v2& request) {
  sockaddr_storage own{};
  sockaddr_storage peer{};
  socklen_t own_length = sizeof own;
  socklen_t peer_length = sizeof peer;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &own_length) != 0 ||
      getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &peer_length) != 0 ||
      own.ss_family != peer.ss_family) {
    return false;
  }
  request.sdiag_family = static_cast<__u8>(own.ss_family);
  request.sdiag_protocol = IPPROTO_TCP;
  request.idiag_states = ~0U;
  request.id.idiag_cookie[0] = request.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  // The peer's socket: its source is our peer.
  if (own.ss_family == AF_INET) {
    const auto& here = reinterpret_cast<const sockaddr_in&>(own);
    const auto& there = reinterpret_cast<const sockaddr_in&>(peer);
    request.id.idiag_sport = there.sin_port;
    request.id.idiag_dport = here.sin_port;
    request.id.idiag_src[0] = there.sin_addr.s_addr;
    request.id.idiag_dst[0] = here.sin_addr.s_addr;
    return true;
  }
  if (own.ss_family != AF_INET6) return false;
  const auto& here = reinterpret_cast<const sockaddr_in6&>(own);
  const auto& there = reinterpret_cast<const sockaddr_in6&>(peer);
  request.id.idiag_sport = there.sin6_port;
  request.id.idiag_dport = here.sin6_port;
  std::memcpy(request.id.idiag_src, &there.sin6_addr, sizeof there.sin6_addr);
  std::memcpy(request.id.idiag_dst, &here.sin6_addr, sizeof here.sin6_addr);
  return true;
}

}  // namespace

PeerLookup::PeerLookup() : channel_(socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG)) {}

PeerLookup::~PeerLookup() {
  if (channel_ >= 0) close(channel_);
}

std::optional<unsigned> PeerLookup::user_of_loopback_peer(int descriptor) {
  Diagnosis question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.header.nlmsg_seq = ++asked_;
  if (channel_ < 0 || !fill_ends(descriptor, question.request)) return std::nullopt;
  if (send(channel_, &question, sizeof question, 0) != static_cast<ssize_t>(sizeof question)) {
    return std::nullopt;
  }
  alignas(nlmsghdr) std::array<char, 4096> answer{};
  const auto* header = reinterpret_cast<const nlmsghdr*>(answer.data());
  ssize_t size = 0;
  do {  // an answer that was missed before must not be taken for this one, nor for the next
    size = recv(channel_, answer.data(), answer.size(), 0);
  } while ((size < 0 && errno == EINTR) ||
           (size >= static_cast<ssize_t>(sizeof *header) && header->nlmsg_seq != asked_));
  const bool is_complete = size >= static_cast<ssize_t>(NLMSG_LENGTH(sizeof(inet_diag_msg)));
  if (!is_complete || header->nlmsg_type != SOCK_DIAG_BY_FAMILY) return std::nullopt;
  const auto* found = reinterpret_cast<const inet_diag_msg*>(answer.data() + NLMSG_HDRLEN);
  // A socket that its owner has closed has no owner, which reads as user 0.
  if (found->idiag_inode == 0) return std::nullopt;
  return found->idiag_uid;
}

std::optional<unsigned> PeerLookup::user_of_unix_peer(int descriptor) {
  ucred peer{};
  socklen_t length = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) return std::nullopt;
  return peer.uid;
}

std::optional<unsigned> user_id(const std::string& name) {
  std::array<char, kNameBuffer> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return std::nullopt;
  }
  return found->pw_uid;
}

std::optional<unsigned> group_id(const std::string& name) {
  std::array<char, kNameBuffer> buffer{};
  group entry{};
  group* found = nullptr;
  if (getgrnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return std::nullopt;
  }
  return found->gr_gid;
}

std::string group_name(unsigned id) {
  std::array<char, kNameBuffer> buffer{};
  group entry{};
  group* found = nullptr;
  if (getgrgid_r(id, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return std::to_string(id);
  }
  return found->gr_name;
}

LocalUser user_of_id(unsigned id) {
  std::array<char, kNameBuffer> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(id, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return {std::to_string(id), {}};
  }
  LocalUser user{found->pw_name, {}};
  std::array<gid_t, 128> groups{};
  int count = static_cast<int>(groups.size());
  getgrouplist(found->pw_name, found->pw_gid, groups.data(), &count);
  count = std::min(count, static_cast<int>(groups.size()));
  for (int i = 0; i < count; ++i) user.groups.push_back(group_name(groups[static_cast<std::size_t>(i)]));
  return user;
}

}  // namespace hapticd::server
