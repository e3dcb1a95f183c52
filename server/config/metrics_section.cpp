#include "server/config/metrics_section.h"

#include <fmt/format.h>

#include "server/text/toml_text.h"

namespace hapticd::server {

std::optional<hal::Error> read_metrics(TomlTable table, const std::string& source, MetricsConfig& metrics) {
  std::string listen;
  table.read("listen", listen, 256);
  table.read("beyond_this_machine", metrics.beyond_this_machine);
  if (listen.empty()) return std::nullopt;
  const std::string where = fmt::format("[metrics] listen, {}, line {}", source, table.line_of("listen"));
  auto address =
      metrics.beyond_this_machine ? parse_tls_address(listen, where) : parse_listen_address(listen, where);
  if (!address) {
    hal::Error error = address.error();
    // Not a matter of certificates: figures are only read.
    if (!metrics.beyond_this_machine && parse_tls_address(listen, where)) {
      error.what = "refusing to show metrics beyond this machine: all who reach the port may read them";
      error.remedy = "listen on 127.0.0.1, or set beyond_this_machine = true in [metrics]";
    }
    return error;
  }
  metrics.listen = *address;
  return std::nullopt;
}

std::string write_metrics(const MetricsConfig& metrics) {
  return fmt::format("\n[metrics]\nlisten = {}\nbeyond_this_machine = {}\n",
                     toml_quoted(metrics.listen ? metrics.listen->text() : std::string()),
                     metrics.beyond_this_machine);
}

}  // namespace hapticd::server
