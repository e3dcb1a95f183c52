#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/config/listen_address.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// The page for people, served by the daemon.
struct ConsoleConfig {
  std::optional<ListenAddress> listen;  ///< [console] listen, this machine only; absent = off
  std::optional<ListenAddress>
      listen_tls;  ///< [console] listen_tls, with [network] certificates; absent = off
  /// [console] names: other names of this machine that a browser may ask for, separated by commas.
  std::vector<std::string> names;
  double max_sockets = 64.0;          ///< live connections of pages at once
  double max_requests_per_s = 200.0;  ///< of one session; stops do not count
  double session_h = 24.0 * 7.0;      ///< how long a browser stays signed in

  bool is_on() const { return listen || listen_tls; }
};

/// Reads [console]; `source` names the file in errors.
std::optional<hal::Error> read_console(TomlTable table, const std::string& source, ConsoleConfig& console);
/// The section with every default; reads back as the same.
std::string write_console(const ConsoleConfig& console);

}  // namespace hapticd::server
