#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace hapticd::test {

/// A recording written for one test, removed with it.
class ReplayFile {
 public:
  explicit ReplayFile(std::string_view content) {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string(test->test_suite_name()) + "." + test->name();
    for (char& c : name) {
      if (c == '/') c = '.';  // parameterised tests
    }
    path_ = (std::filesystem::path(::testing::TempDir()) / ("hapticd_" + name + ".csv")).string();
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~ReplayFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  ReplayFile(const ReplayFile&) = delete;
  ReplayFile& operator=(const ReplayFile&) = delete;

  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
};

}  // namespace hapticd::test
