#include "server/config/console_section.h"

#include <fmt/format.h>

#include "server/text/toml_text.h"

namespace hapticd::server {

void read_console(TomlTable table, ConsoleConfig& console) {
  table.read("user", console.user, 64);
  for (const char* moved :
       {"listen", "listen_tls", "names", "max_sockets", "max_requests_per_s", "session_h"}) {
    table.refuse(moved, hal::Error::of(hal::ErrorCode::kMisplacedKey,
                                       "the console is a program of its own, which the daemon does not start",
                                       "", moved, "user",
                                       fmt::format("move it to the configuration of hapticd-console, "
                                                   "/etc/hapticd/console.toml: {} = ...",
                                                   moved)));
  }
}

std::string write_console(const ConsoleConfig& console) {
  return fmt::format("\n[console]\nuser = {}\n", toml_quoted(console.user));
}

}  // namespace hapticd::server
