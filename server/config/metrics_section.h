#pragma once

#include <optional>
#include <string>

#include "server/config/listen_address.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Figures for Prometheus.
struct MetricsConfig {
  std::optional<ListenAddress> listen;  ///< [metrics] listen; absent = off
  /// [metrics] beyond_this_machine: `listen` may be any address. All who reach it may read the figures.
  bool beyond_this_machine = false;
};

/// Reads [metrics]; `source` names the file in errors.
std::optional<hal::Error> read_metrics(TomlTable table, const std::string& source, MetricsConfig& metrics);
/// Writes the section with every default; reads back as the same.
std::string write_metrics(const MetricsConfig& metrics);

}  // namespace hapticd::server
