#include "client/cpp/address.h"

#include <charconv>
#include <string_view>

#include "client/cpp/error.h"

namespace hapticd::client {
namespace {

[[noreturn]] void refuse(const std::string& address, const std::string& what) {
  v1::ErrorDetail detail;
  detail.set_what(what);
  detail.set_where("server address");
  detail.set_value("'" + address + "'");
  detail.set_limit("host:port (port 1 … 65535), [v6]:port or unix:/path; tls: before a host of this machine");
  throw Error(ErrorKind::kBadAddress, "", detail);
}

bool is_port(std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc{} && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

}  // namespace

std::string channel_target(const std::string& address) {
  constexpr std::string_view kUnix = "unix:";
  if (address.starts_with(kUnix)) {
    if (address.size() == kUnix.size()) refuse(address, "the path of the unix socket is missing");
    return address;
  }
  constexpr std::string_view kTls = "tls:";
  const std::string plain = address.starts_with(kTls) ? address.substr(kTls.size()) : address;
  const auto colon = plain.rfind(':');
  if (colon == std::string::npos) refuse(address, "the port is missing");
  const std::string host = plain.substr(0, colon);
  if (!is_port(std::string_view(plain).substr(colon + 1))) refuse(address, "the port is not a port number");
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (host.empty()) refuse(address, "the host is missing");
  if (!bracketed && host.find_first_of(":/ ") != std::string::npos)
    refuse(address, "the host is not a host name");
  return "dns:///" + plain;
}

}  // namespace hapticd::client
