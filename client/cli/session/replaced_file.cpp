#include "client/cli/session/replaced_file.h"

#include <filesystem>
#include <system_error>

namespace hapticd::cli {

bool is_replaced(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

std::string_view replaced_words(bool replaces) {
  return replaces ? "; the file that was there is replaced" : "";
}

}  // namespace hapticd::cli
