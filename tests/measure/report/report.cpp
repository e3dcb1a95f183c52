#include "tests/measure/report/report.h"

#include <fstream>
#include <iostream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "client/cli/figure/gnuplot.h"

namespace hapticd::report {
namespace {

constexpr double kTitlePx = 30.0;

}  // namespace

PlotSeries dots(std::string name, std::string color) {
  PlotSeries series{.name = std::move(name), .color = std::move(color)};
  series.marks_only();
  return series;
}

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

void Report::add_plot(const std::string& its_name, const Plot& plot, const PlotSize& size) {
  const std::string name = its_name + suffix_;
  cli::Figure figure{.title = plot.title + in_titles_,
                     .width_px = size.width_px,
                     .height_px = size.height_px,
                     .panels = {plot}};
  figure.panels[0].title.clear();
  figure.panels[0].height = 1.0 - kTitlePx / size.height_px;
  figure.panels[0].legend = Plot::Legend::kRight;
  const auto script = folder_ / (name + ".gp");
  std::ofstream stream(script, std::ios::trunc);
  stream << cli::gnuplot_script(figure, name + ".svg") << std::flush;
  if (!stream) throw std::runtime_error("cannot write '" + script.string() + "'");
  const std::string svg = (folder_ / (name + ".svg")).string();
  const auto problem = cli::draw_svg(figure, svg);
  section_.add_plot(name, figure.title, problem ? problem->what + "; " + problem->remedy : "");
  note("plot: " + (problem ? name + ".svg was not drawn: " + problem->what + "; " + problem->remedy : svg));
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
