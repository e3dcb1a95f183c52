#include "tests/measure/report/report.h"

#include <fstream>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace hapticd::report {

void Report::set_condition(const std::string& name, const std::string& value, const std::string& suffix) {
  figures_.set_common(name.empty() ? Case{} : Case{{name, value}});
  in_titles_ = name.empty() ? "" : ", " + name + ' ' + value;
  suffix_ = suffix;
}

void Report::begin_section(const std::string& name, const std::string& title) {
  section_ = SectionWriter(folder_, name + suffix_, title + in_titles_);
}

void Report::say(const std::string& text) {
  std::cout << '\n' << text << std::endl;
  section_.add_text(text);
}

void Report::add_table(const std::string& name, const std::string& title, const MarkdownTable& table,
                       const std::string& remark) {
  const std::string full_title = title + in_titles_;
  const std::string text =
      "## " + full_title + "\n\n" + (remark.empty() ? "" : remark + "\n\n") + table.text();
  const auto path = folder_ / (name + suffix_ + ".md");
  std::ofstream stream(path, std::ios::trunc);
  stream << text << std::flush;
  if (!stream) throw std::runtime_error("cannot write '" + path.string() + "'");
  std::cout << '\n' << text << std::flush;
  section_.add_table(full_title, table, remark);
}

void Report::add_plot(const std::string& its_name, const SvgPlot& without_condition) {
  const std::string name = its_name + suffix_;
  SvgPlot plot = without_condition;
  plot.title += in_titles_;
  const auto problem = draw(plot, folder_, name);
  section_.add_plot(name, plot.title, problem.value_or(""));
  note(problem ? "plot: " + *problem : "plot: " + (folder_ / (name + ".svg")).string());
}

void Report::take_over(const std::filesystem::path& folder) {
  figures_.add_from(folder / "figures.jsonl");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  for (const auto& file : files) {
    const auto kind = file.extension();
    if (kind != ".md" && kind != ".csv" && kind != ".gp" && kind != ".svg") continue;
    std::filesystem::copy_file(file, folder_ / file.filename(),
                               std::filesystem::copy_options::overwrite_existing);
  }
  if (!std::filesystem::is_directory(sections_folder(folder))) return;
  for (const auto& entry : std::filesystem::directory_iterator(sections_folder(folder)))
    section_.add_from(entry.path());
}

void Report::note(const std::string& line) {
  std::cout << line << std::endl;
}

}  // namespace hapticd::report
