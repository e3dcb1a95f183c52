#include "client/console/access/connection_user.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>

namespace hapticd::console {

namespace {

using Endpoint = boost::asio::ip::tcp::endpoint;

/// The bytes of an address, four at a time as the machine reads them, then the port: "0100007F:C3A0".
std::string as_listed(const Endpoint& end) {
  const auto in_words = [](const auto& bytes) {
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint32_t)) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes.data() + i, sizeof word);
      text += fmt::format("{:08X}", word);
    }
    return text;
  };
  const auto& address = end.address();
  const std::string host =
      address.is_v4() ? in_words(address.to_v4().to_bytes()) : in_words(address.to_v6().to_bytes());
  return fmt::format("{}:{:04X}", host, end.port());
}

}  // namespace

std::optional<unsigned> user_in_list(std::istream& list, const Endpoint& peer, const Endpoint& own) {
  const std::string local = as_listed(peer);
  const std::string remote = as_listed(own);
  std::string line;
  while (std::getline(list, line)) {
    if (line.find(local) == std::string::npos) continue;  // most lines
    // sl, local and remote address, state, queues, timer, retransmissions, user
    std::istringstream words(line);
    std::string number;
    std::string from;
    std::string to;
    std::string skipped;
    unsigned user = 0;
    if (words >> number >> from >> to >> skipped >> skipped >> skipped >> skipped >> user && from == local &&
        to == remote) {
      return user;
    }
  }
  return std::nullopt;
}

std::optional<unsigned> user_of_connection(const Endpoint& peer, const Endpoint& own) {
  std::ifstream list(peer.address().is_v4() ? "/proc/net/tcp" : "/proc/net/tcp6");
  return user_in_list(list, peer, own);
}

}  // namespace hapticd::console
