#include "client/cli/plot/temporary_csv.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "client/cli/session/session.h"

namespace hapticd::cli {

TemporaryCsv::TemporaryCsv() {
  folder_ = (std::filesystem::temp_directory_path() / "hapticctl-table-XXXXXX").string();
  if (mkdtemp(folder_.data()) == nullptr) {
    throw LocalError("no folder for a temporary file can be made", folder_, std::strerror(errno), "",
                     "see TMPDIR");
  }
  path_ = folder_ + "/table.csv";
}

TemporaryCsv::~TemporaryCsv() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace hapticd::cli
