#include "server/config/listen_address.h"

#include <arpa/inet.h>

#include <charconv>
#include <string>

namespace hapticd::server {

namespace {

enum class Host { kLoopback, kElsewhere, kUnknown };

Host classify(const std::string& host) {
  if (host == "localhost") return Host::kLoopback;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) {
    return (ntohl(v4.s_addr) >> 24U) == 127U ? Host::kLoopback : Host::kElsewhere;
  }
  in6_addr v6{};
  if (inet_pton(AF_INET6, host.c_str(), &v6) == 1) {
    return IN6_IS_ADDR_LOOPBACK(&v6) ? Host::kLoopback : Host::kElsewhere;
  }
  return Host::kUnknown;
}

hal::Result<ListenAddress> split(std::string_view text, std::string_view where) {
  hal::Error error;
  error.code = hal::ErrorCode::kMalformed;
  error.where = where;
  error.value = text;
  error.limit = "HOST:PORT, e.g. 127.0.0.1:50051 or [::1]:50051";
  error.remedy = "write host and port";

  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    error.what = "the address has no port";
    return error;
  }
  std::string_view host = text.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string_view::npos) {
    error.what = "an IPv6 address needs brackets";
    return error;
  }
  const std::string_view digits = text.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (failure != std::errc{} || end != digits.data() + digits.size() || digits.empty()) {
    error.what = "the port is not a number";
    error.limit = "0 … 65535";
    return error;
  }
  return ListenAddress{std::string(host), port};
}

}  // namespace

std::string ListenAddress::text() const {
  const std::string port_text = std::to_string(port);
  return host.find(':') == std::string::npos ? host + ":" + port_text : "[" + host + "]:" + port_text;
}

hal::Result<ListenAddress> parse_listen_address(std::string_view text, std::string_view where) {
  auto address = split(text, where);
  if (!address) return address;
  hal::Error error;
  switch (classify(address->host)) {
    case Host::kLoopback:
      return address;
    case Host::kElsewhere:
      error.what =
          "refusing to listen beyond this machine: the connection is neither encrypted nor authenticated";
      break;
    case Host::kUnknown:
      error.what = "refusing to listen on a host that is not known to be this machine's loopback";
      break;
  }
  error.code = hal::ErrorCode::kOutOfRange;
  error.where = where;
  error.value = text;
  error.limit = "127.0.0.0/8, ::1, localhost";
  error.remedy =
      "listen there with certificates (--listen-tls, deploy/make_certificates.sh), or on 127.0.0.1 and reach "
      "it through an SSH tunnel";
  return error;
}

hal::Result<ListenAddress> parse_tls_address(std::string_view text, std::string_view where) {
  auto address = split(text, where);
  if (!address || classify(address->host) != Host::kUnknown) return address;
  return hal::Error::of(hal::ErrorCode::kMalformed, "the host is not an address in numbers",
                        std::string(where), std::string(text),
                        "e.g. 192.168.1.20:50051, [fd00::20]:50051, 0.0.0.0:50061",
                        "a name may mean another address here than for clients: write the number");
}

}  // namespace hapticd::server
