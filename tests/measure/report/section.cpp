#include "tests/measure/report/section.h"

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

std::filesystem::path sections_folder(const std::filesystem::path& folder) {
  return folder / "sections";
}

SectionWriter::SectionWriter(const std::filesystem::path& folder, const std::string& name,
                             const std::string& title) {
  std::filesystem::create_directories(sections_folder(folder));
  const auto path = sections_folder(folder) / (name + ".jsonl");
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

void SectionWriter::add_from(const std::filesystem::path& section) {
  std::ifstream file(section);
  for (std::string line; std::getline(file, line);) {
    const Json item = Json::parse(line, nullptr, false);
    if (item.is_object() && item.value("kind", "") != "section") write_line(line);
  }
}

void SectionWriter::write_line(const std::string& line) {
  if (!stream_.is_open()) return;
  stream_ << line << '\n' << std::flush;
}

}  // namespace hapticd::report
