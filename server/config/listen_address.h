#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// Address on which the service listens on TCP.
struct ListenAddress {
  std::string host = "127.0.0.1";
  std::uint16_t port = 50051;  ///< 0 = any free one

  /// "127.0.0.1:50051", "[::1]:50051".
  std::string text() const;
};

/// Reads HOST:PORT. Anything but this machine's loopback (127.0.0.0/8, ::1, localhost) is refused: the
/// connection is neither encrypted nor authenticated, and force goes to a person's hand. `where` is for the
/// error.
hal::Result<ListenAddress> parse_listen_address(std::string_view text, std::string_view where);
/// Parses an address for connections with certificates: any address of this machine, in numbers.
hal::Result<ListenAddress> parse_tls_address(std::string_view text, std::string_view where);

}  // namespace hapticd::server
