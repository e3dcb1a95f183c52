#pragma once

#include <filesystem>
#include <string>

#include "tests/measure/report/figure_writer.h"
#include "tests/measure/report/markdown_table.h"
#include "tests/measure/report/section.h"
#include "tests/measure/report/svg_plot.h"

namespace hapticd::report {

/// The output folder of a study or a benchmark: figures.jsonl next to readable tables and plots; and, for a
/// page of all of it (html_page.h), what was shown in each section and in what order.
class Report {
 public:
  /// Makes the folder; throws std::runtime_error if it cannot be written to.
  explicit Report(std::filesystem::path folder) : folder_(std::move(folder)), figures_(folder_) {}

  /// A condition of all that is added from now on: figures have it in their case, titles of sections, tables
  /// and plots end in it, and names of sections and files in `suffix`, so that the same part can appear once
  /// for each. Empty name = no condition.
  void set_condition(const std::string& name, const std::string& value, const std::string& suffix);

  /// What is added from now on is in section `name` of the page, under `title`; an earlier run's section
  /// of that name is replaced.
  void begin_section(const std::string& name, const std::string& title);
  /// A paragraph of the section: what is seen, what follows from it. Printed too.
  void say(const std::string& text);

  const std::filesystem::path& folder() const noexcept { return folder_; }

  void add(const Figure& figure) { figures_.add(figure); }
  /// Writes NAME.md and prints it. `remark` (may be empty) is under the title: conditions, how to read
  /// it.
  void add_table(const std::string& name, const std::string& title, const MarkdownTable& table,
                 const std::string& remark = {});
  /// Writes NAME.csv, NAME.gp and NAME.svg; if gnuplot is missing or fails it says so and goes on.
  void add_plot(const std::string& name, const SvgPlot& plot);
  /// What another program left in `folder`: its figures, plots and tables become this report's, its sections
  /// part of the present one. Throws std::runtime_error if they cannot be copied.
  void take_over(const std::filesystem::path& folder);
  /// A line for the reader at the terminal.
  static void note(const std::string& line);

 private:
  std::filesystem::path folder_;
  FigureWriter figures_;
  SectionWriter section_;
  std::string in_titles_;  ///< ", plant general"
  std::string suffix_;
};

}  // namespace hapticd::report
