#include "client/console/access/connection_user.h"

#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace hapticd::console {

namespace {

template <class Bytes>
void put(const Bytes& bytes, __be32 (&into)[4]) {
  std::memcpy(into, bytes.data(), bytes.size());
}

}  // namespace

// One question for the one connection: the list of all of them (/proc/net/tcp) takes 8 ms even if it is
// empty, and longer if any user of this machine makes many.
std::optional<unsigned> user_of_connection(const boost::asio::ip::tcp::endpoint& peer,
                                           const boost::asio::ip::tcp::endpoint& own) {
  struct {
    nlmsghdr header{};
    inet_diag_req_v2 request{};
  } question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  inet_diag_req_v2& asked = question.request;
  asked.sdiag_family = static_cast<__u8>(peer.protocol().family());
  asked.sdiag_protocol = IPPROTO_TCP;
  asked.idiag_states = ~0U;
  asked.id.idiag_cookie[0] = asked.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  asked.id.idiag_sport = htons(peer.port());  // of the other end's socket
  asked.id.idiag_dport = htons(own.port());
  if (peer.address().is_v4() && own.address().is_v4()) {
    put(peer.address().to_v4().to_bytes(), asked.id.idiag_src);
    put(own.address().to_v4().to_bytes(), asked.id.idiag_dst);
  } else if (peer.address().is_v6() && own.address().is_v6()) {
    put(peer.address().to_v6().to_bytes(), asked.id.idiag_src);
    put(own.address().to_v6().to_bytes(), asked.id.idiag_dst);
  } else {
    return std::nullopt;
  }
  const int kernel = socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG);
  if (kernel < 0) return std::nullopt;
  alignas(nlmsghdr) std::array<char, 4096> answer{};
  ssize_t size = -1;
  if (send(kernel, &question, sizeof question, 0) == static_cast<ssize_t>(sizeof question))
    size = recv(kernel, answer.data(), answer.size(), 0);
  close(kernel);
  const auto* header = reinterpret_cast<const nlmsghdr*>(answer.data());
  const bool is_complete = size >= static_cast<ssize_t>(NLMSG_LENGTH(sizeof(inet_diag_msg)));
  if (!is_complete || header->nlmsg_type != SOCK_DIAG_BY_FAMILY) return std::nullopt;
  const auto* found = reinterpret_cast<const inet_diag_msg*>(answer.data() + NLMSG_HDRLEN);
  // A socket that its owner has closed has no owner, which reads as user 0.
  if (found->idiag_inode == 0) return std::nullopt;
  return found->idiag_uid;
}

}  // namespace hapticd::console
