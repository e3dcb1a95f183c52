#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hapticd::report {

/// What the page says of itself.
struct PageText {
  std::string title;
  std::string readers{};  ///< for those who did not write it: what was measured, and how to read it
  std::string introduction;
  /// Names of sections in the order they are to be read; those that are not in the folder are left out, those
  /// that are there and not named come behind, by name.
  std::vector<std::string> order{};
};

/// Makes of all that studies and benchmarks left in `folder` one page that needs no other file,
/// FOLDER/report.html, next to the same as FOLDER/report.json. The same
/// folder gives the same bytes. Throws std::runtime_error if they cannot be written.
void write_page(const std::filesystem::path& folder, const PageText& text);

}  // namespace hapticd::report
