#include "client/console/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "client/cpp/certificates.h"
#include "proto/text/usage_message.h"

namespace hapticd::console {

namespace {

constexpr int kBadOptions = 2;
constexpr std::size_t kMaxNames = 32;

struct Texts {
  std::string listen;
  std::string listen_tls;
  std::string names;
};

/// HOST:PORT with a host in numbers, or localhost.
PageAddress parse_address(const std::string& text, const std::string& option) {
  const auto refuse = [&](const std::string& what) {
    throw CLI::ValidationError(option,
                               fmt::format("'{}': {}, e.g. 127.0.0.1:50080 or [::1]:50080", text, what));
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse("the port is missing");
  PageAddress address;
  address.host = text.substr(0, colon);
  if (address.host.starts_with('[') && address.host.ends_with(']')) {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  std::uint16_t port = 0;
  const char* digits = text.data() + colon + 1;
  const char* digits_end = text.data() + text.size();
  const auto [end, failure] = std::from_chars(digits, digits_end, port);
  if (failure != std::errc{} || end != digits_end) refuse("the port is not a number of 0 … 65535");
  boost::system::error_code error;
  const auto host =
      boost::asio::ip::make_address(address.host == "localhost" ? "127.0.0.1" : address.host, error);
  if (error) refuse("the host is not an address in numbers");
  address.endpoint = {host, port};
  return address;
}

std::vector<std::string> split_names(const std::string& text) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789.-:";
  std::vector<std::string> names;
  std::string name;
  for (const char c : text + ",") {
    if (c == ' ') continue;
    if (c != ',') {
      name += c;
      continue;
    }
    if (name.empty()) continue;
    if (names.size() == kMaxNames || name.find_first_not_of(kLetters) != std::string::npos) {
      throw CLI::ValidationError(
          "--names",
          fmt::format("'{}': at most 32 names of a-z, 0-9, '.', '-', ':', separated by commas, as a "
                      "browser's address bar shows them, without http:// and port",
                      name));
    }
    names.push_back(std::move(name));
    name.clear();
  }
  return names;
}

void take(const Texts& texts, Options& options) {
  if (!texts.listen.empty()) options.listen = parse_address(texts.listen, "--listen");
  if (!texts.listen_tls.empty()) options.listen_tls = parse_address(texts.listen_tls, "--listen_tls");
  options.names = split_names(texts.names);
  if (options.listen && !options.listen->endpoint.address().is_loopback()) {
    throw CLI::ValidationError(
        "--listen", fmt::format("'{}': refusing to listen beyond this machine without certificates; use "
                                "--listen_tls and --certificates, or listen on 127.0.0.1",
                                texts.listen));
  }
  if (options.listen_tls && options.daemon.certificates.empty()) {
    throw CLI::ValidationError("--listen_tls",
                               "refusing to show the console beyond this machine without certificates; give "
                               "--certificates a folder with server.crt, server.key and authority.crt (see "
                               "deploy/make_certificates.sh)");
  }
  if (!options.listen && !options.listen_tls) {
    throw CLI::ValidationError("--listen", "give it an address to listen on, e.g. 127.0.0.1:50080");
  }
  if (options.is_personal && options.listen_tls) {
    throw CLI::ValidationError("--personal", "is for one user of this machine, without --listen_tls");
  }
  const std::string& server = options.daemon.address;
  if (!options.is_personal && !server.starts_with("unix:") && !client::needs_certificates(server)) {
    throw CLI::ValidationError(
        "--server",
        fmt::format("'{}': the daemon lets a console call for others over its unix socket or with a "
                    "certificate of the role console; give unix:PATH or tls:HOST:PORT, or --personal",
                    server));
  }
}

}  // namespace

std::string PageAddress::text(std::uint16_t port) const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

std::optional<Options> read_options(int argc, char** argv, int& exit_code) {
  Options options;
  Texts texts;
  if (const char* folder = std::getenv("STATE_DIRECTORY")) options.state = folder;
  CLI::App app("The page of a rig for people: serves it to browsers, and makes their calls to hapticd.",
               "hapticd-console");
  app.set_version_flag("--version", "hapticd-console " HAPTICD_VERSION);
  app.set_config("--config", "", "Configuration file: the options below, as in listen = \"127.0.0.1:50080\"")
      ->type_name("FILE");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.add_option("--server", options.daemon.address,
                 "Where hapticd listens: unix:/path, tls:HOST:PORT, or, with --personal, HOST:PORT")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option("--certificates", options.daemon.certificates,
                 "Folder: server.crt, server.key for browsers; client.crt, client.key (role console) for a "
                 "daemon elsewhere; authority.crt")
      ->type_name("DIR");
  app.add_option("--listen", texts.listen, "Loopback address of the page; port 0 takes a free one")
      ->type_name("HOST:PORT");
  app.add_option("--listen_tls", texts.listen_tls,
                 "Address of the page for browsers with certificates, e.g. 192.168.1.20:8443")
      ->type_name("ADDRESS:PORT");
  app.add_option(
      "--names", texts.names,
      "Other names by which a browser may ask for the page, separated by commas, e.g. rig.lab.example");
  app.add_option("--state", options.state,
                 "Folder of console.key, by which browsers stay signed in [$STATE_DIRECTORY]")
      ->type_name("DIR");
  app.add_option("--max_sockets", options.max_sockets, "Pages at once")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--max_requests_per_s", options.max_requests_per_s, "Of one identity; stops do not count")
      ->check(CLI::Range(10.0, 10'000.0))
      ->capture_default_str();
  app.add_option("--session_h", options.session_h, "Hours that a browser stays signed in")
      ->check(CLI::Range(0.1, 24.0 * 366.0))
      ->capture_default_str();
  app.add_flag("--personal", options.is_personal,
               "Serve one page for yourself: prints its address, which works once, and ends with the page");
  app.footer(
      "Examples:\n"
      "  hapticd-console --config /etc/hapticd/console.toml\n"
      "  hapticd-console --personal --server 127.0.0.1:50051 --listen 127.0.0.1:0      as hapticctl console "
      "does\n\n"
      "Exit codes: 0 clean, 2 bad command line or configuration, 3 cannot listen or no certificates.");
  app.failure_message(text::usage_message);
  try {
    app.parse(argc, argv);
    take(texts, options);
    return options;
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error) == 0 ? 0 : kBadOptions;
    return std::nullopt;
  }
}

}  // namespace hapticd::console
