#include "tests/study/report/section.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace hapticd::report {
namespace {

using Json = nlohmann::ordered_json;

/// Texts may hold bytes of a child process; a broken one must not cost the section.
std::string line_of(const Json& item) {
  return item.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::filesystem::path section_path(const std::filesystem::path& folder, const std::string& name) {
  return folder / "sections" / (name + ".jsonl");
}

SectionWriter::SectionWriter(const std::filesystem::path& folder, const std::string& name,
                             const std::string& title) {
  const auto path = section_path(folder, name);
  std::filesystem::create_directories(path.parent_path());
  stream_.open(path, std::ios::trunc);
  write_line(line_of({{"kind", "section"}, {"name", name}, {"title", title}}));
  if (!stream_) throw std::runtime_error("cannot write '" + path.string() + "'");
}

void SectionWriter::add_text(const std::string& text) {
  write_line(line_of({{"kind", "text"}, {"text", text}}));
}

void SectionWriter::add_table(const std::string& title, const MarkdownTable& table,
                              const std::string& remark) {
  write_line(line_of({{"kind", "table"},
                      {"title", title},
                      {"remark", remark},
                      {"headers", table.headers()},
                      {"rows", table.rows()}}));
}

void SectionWriter::add_plot(const std::string& name, const std::string& title, const std::string& missing) {
  write_line(line_of({{"kind", "plot"}, {"name", name}, {"title", title}, {"missing", missing}}));
}

void SectionWriter::write_line(const std::string& line) {
  if (!stream_.is_open()) return;
  stream_ << line << '\n' << std::flush;
}

}  // namespace hapticd::report
