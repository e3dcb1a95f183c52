#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/study/report/markdown_table.h"

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
  /// Throws std::runtime_error where the file cannot be written.
  SectionWriter(const std::filesystem::path& folder, const std::string& name, const std::string& title);

  void add_text(const std::string& text);
  void add_table(const std::string& title, const MarkdownTable& table, const std::string& remark);
  void add_plot(const std::string& name, const std::string& title, const std::string& missing);

 private:
  void write_line(const std::string& line);

  std::ofstream stream_;
};

/// Where section `name` of a report is kept.
std::filesystem::path section_path(const std::filesystem::path& folder, const std::string& name);

}  // namespace hapticd::report
