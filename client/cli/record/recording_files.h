#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Options of an export of a recording or an incident.
struct ExportOptions {
  std::string id;
  std::string out;
  std::string columns;
  double from_s = 0.0;
  double to_s = 0.0;
  std::uint32_t decimation = 1;
};

/// Id of a file: as it was given, or the newest for "last". Throws LocalError if there is none.
std::string file_id(client::Client& client, const std::string& id, v1::RecordingKind kind);

/// Adds the commands that recordings and incidents have in common, below `parent`; `name` for their help.
void add_list_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name);
void add_get_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name);
void add_export_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name);
void add_delete_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name);

}  // namespace hapticd::cli
