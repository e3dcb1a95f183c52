#include "server/model/store/default_model_store.h"

#include <cstdlib>
#include <filesystem>

namespace hapticd::server {

namespace {

/// Folder in a variable; relative ones are ignored, by the XDG base directory specification.
std::filesystem::path folder_in(const char* variable) {
  const char* value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): before there are threads
  const std::filesystem::path folder = value != nullptr ? value : "";
  return folder.is_absolute() ? folder : std::filesystem::path();
}

}  // namespace

std::string default_model_store() {
  constexpr const char* kFile = "models.sqlite";
  if (const auto list = folder_in("STATE_DIRECTORY").string(); !list.empty()) {
    return std::filesystem::path(list.substr(0, list.find(':'))) / kFile;
  }
  if (const auto state = folder_in("XDG_STATE_HOME"); !state.empty()) return state / "hapticd" / kFile;
  if (const auto home = folder_in("HOME"); !home.empty()) return home / ".local/state/hapticd" / kFile;
  return {};
}

}  // namespace hapticd::server
