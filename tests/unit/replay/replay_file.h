#pragma once

#include <string>
#include <string_view>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A recording written for one test, removed with it.
class ReplayFile {
 public:
  explicit ReplayFile(std::string_view content)
      : path_(folder_.write("recording.csv", std::string(content))) {}

  const std::string& path() const noexcept { return path_; }

 private:
  TemporaryFolder folder_;
  std::string path_;
};

}  // namespace hapticd::test
