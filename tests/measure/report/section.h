#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/measure/report/markdown_table.h"

namespace hapticd::report {

/// One section of the page as it comes about: FOLDER/sections/NAME.jsonl, an item a line, so that several
/// programs can add to one page and a run that dies leaves what it had.
///   {"kind": "section", "name", "title"}            the first line
///   {"kind": "text", "text"}
///   {"kind": "table", "title", "remark", "headers": [...], "rows": [[...]...]}
///   {"kind": "plot", "name", "title", "missing"}    FOLDER/NAME.svg; `missing` says why there is none
class SectionWriter {
 public:
  SectionWriter() = default;  ///< no section: what is added is not kept
  /// Throws std::runtime_error if the file cannot be written.
  SectionWriter(const std::filesystem::path& folder, const std::string& name, const std::string& title);

  void add_text(const std::string& text);
  void add_table(const std::string& title, const MarkdownTable& table, const std::string& remark);
  void add_plot(const std::string& name, const std::string& title, const std::string& missing);
  /// All items of another section's file.
  void add_from(const std::filesystem::path& section);

 private:
  void write_line(const std::string& line);

  std::ofstream stream_;
};

/// Folder in which a report keeps its sections.
std::filesystem::path sections_folder(const std::filesystem::path& folder);

}  // namespace hapticd::report
