#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cpp/client.h"

namespace hapticd::console {

/// Address on which pages are served.
struct PageAddress {
  std::string host;  ///< as it was given, "127.0.0.1", "::1", "localhost"
  boost::asio::ip::tcp::endpoint endpoint;

  /// "127.0.0.1:50080", "[::1]:50080"; `port`: the one in use.
  std::string text(std::uint16_t port) const;
};

/// What the program is started with. The defaults are here and nowhere else.
struct Options {
  client::ClientOptions daemon{.address = "unix:/run/hapticd/hapticd.sock"};
  std::optional<PageAddress> listen;      ///< this machine only
  std::optional<PageAddress> listen_tls;  ///< with the certificates in daemon.certificates
  std::vector<std::string> names;         ///< further names of this machine that browsers may ask for
  std::string state;                      ///< folder of console.key; empty: none
  std::size_t max_sockets = 64;           ///< live connections of pages at once, shared by all identities
  double max_requests_per_s = 200.0;      ///< of one identity; stops do not count
  double session_h = 24.0 * 7.0;          ///< how long a browser stays signed in
  /// True for the user who starts it: every call is this user's own, the only key is printed, and the program
  /// ends some seconds after the last page is gone.
  bool is_personal = false;
};

/// Reads the command line and the configuration file that it names. If the program has nothing more to do
/// (help, version, an error) the text is printed and nothing is returned; `exit_code` is then the program's.
std::optional<Options> read_options(int argc, char** argv, int& exit_code);

}  // namespace hapticd::console
