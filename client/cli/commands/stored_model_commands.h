#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "client/cli/session/session.h"

namespace hapticd::cli {

/// What list shows of the store; empty = all.
struct StoredModelFilter {
  std::string kind;
  std::string object;
  std::string tag;
};

void list_stored_models(Session& session, const StoredModelFilter& filter);
/// Shows a stored model by its hash; false, with nothing printed, if no hash begins so.
bool show_stored_model(Session& session, const std::string& hash);

/// `model` diff, tag, untag, delete, export, import.
void add_stored_model_commands(CLI::App& model, Session& session);

}  // namespace hapticd::cli
