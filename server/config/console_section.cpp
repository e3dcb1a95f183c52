#include "server/config/console_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kSockets{1.0, 1000.0, "sockets"};
constexpr Range kRequestsPerS{10.0, 10'000.0, "requests/s"};
constexpr Range kSessionH{0.1, 24.0 * 366.0, "h"};
constexpr std::size_t kMaxNames = 32;

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == ':';
}

hal::Result<std::vector<std::string>> split_names(const std::string& text, const std::string& where) {
  std::vector<std::string> names;
  std::string name;
  for (const char c : text + ",") {
    if (c == ' ') continue;
    if (c != ',') {
      name += c;
      continue;
    }
    if (name.empty()) continue;
    if (names.size() == kMaxNames || !std::all_of(name.begin(), name.end(), is_name_character)) {
      return hal::Error::of(
          hal::ErrorCode::kMalformed, "not a list of names of this machine", where, name,
          "at most 32, of a-z, 0-9, '.', '-', ':', separated by commas",
          "write them as a browser's address bar shows them, without http:// and port, e.g. "
          "names = \"rig.lab.example\"");
    }
    names.push_back(std::move(name));
    name.clear();
  }
  return names;
}

}  // namespace

std::optional<hal::Error> read_console(TomlTable table, const std::string& source, ConsoleConfig& console) {
  std::string listen;
  std::string listen_tls;
  std::string names;
  table.read("listen", listen, 256);
  table.read("listen_tls", listen_tls, 256);
  table.read("names", names, 4096);
  table.read("max_sockets", console.max_sockets, kSockets);
  table.read("max_requests_per_s", console.max_requests_per_s, kRequestsPerS);
  table.read("session_h", console.session_h, kSessionH);
  const auto where = [&](const char* key) {
    return fmt::format("[console] {}, {}, line {}", key, source, table.line_of(key));
  };
  if (!listen.empty()) {
    auto address = parse_listen_address(listen, where("listen"));
    if (!address) {
      hal::Error error = address.error();
      if (parse_tls_address(listen, where("listen"))) {
        error.remedy = "set listen_tls in [console] and certificates in [network], or listen on 127.0.0.1";
      }
      return error;
    }
    console.listen = *address;
  }
  if (!listen_tls.empty()) {
    auto address = parse_tls_address(listen_tls, where("listen_tls"));
    if (!address) return address.error();
    console.listen_tls = *address;
  }
  auto split = split_names(names, where("names"));
  if (!split) return split.error();
  console.names = std::move(*split);
  return std::nullopt;
}

std::string write_console(const ConsoleConfig& console) {
  std::string names;
  for (const std::string& name : console.names) names += (names.empty() ? "" : ", ") + name;
  return fmt::format(
      "\n[console]\nlisten = {}\nlisten_tls = {}\nnames = {}\nmax_sockets = {}\nmax_requests_per_s = {}\n"
      "session_h = {}\n",
      toml_quoted(console.listen ? console.listen->text() : std::string()),
      toml_quoted(console.listen_tls ? console.listen_tls->text() : std::string()), toml_quoted(names),
      toml_number(console.max_sockets), toml_number(console.max_requests_per_s),
      toml_number(console.session_h));
}

}  // namespace hapticd::server
