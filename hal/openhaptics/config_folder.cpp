#include "hal/openhaptics/config_folder.h"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace hapticd::openhaptics {

namespace {

namespace fs = std::filesystem;

/// Path and reason of a refusal; empty if this process can use it.
std::string refusal_of(const fs::path& path, int mode) {
  if (access(path.c_str(), mode) == 0) return {};
  return path.string() + ": " + std::error_code(errno, std::generic_category()).message();
}

bool is_set(const char* variable) {
  return variable != nullptr && *variable != '\0';
}

}  // namespace

std::string config_folder_problem(const char* gtdd_home, const char* home) {
  const fs::path folder =
      is_set(gtdd_home) ? fs::path(gtdd_home) : fs::path(is_set(home) ? home : "/") / ".3dsystems";
  std::string refusal = refusal_of(folder, R_OK | X_OK);
  std::error_code failure;
  if (const fs::path inner = folder / "config"; refusal.empty() && fs::exists(inner, failure)) {
    refusal = refusal_of(inner, R_OK | X_OK);
    for (fs::directory_iterator file(inner, failure), end; refusal.empty() && file != end;
         file.increment(failure))
      refusal = refusal_of(file->path(), R_OK);
  }
  if (refusal.empty()) return {};
  return "the vendor's library finds the devices that were set up in " + folder.string() + " (" +
         (is_set(gtdd_home) ? "GTDD_HOME" : "GTDD_HOME is not set") +
         "), which the user of the daemon cannot read (" + refusal +
         "): copy what the vendor's setup program wrote there, and let the group hapticd read it "
         "(docs/installation.md)";
}

}  // namespace hapticd::openhaptics
