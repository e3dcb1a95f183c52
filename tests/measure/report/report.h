#pragma once

#include <filesystem>
#include <string>

#include "client/cli/figure/figure.h"
#include "tests/measure/report/figure_writer.h"
#include "tests/measure/report/markdown_table.h"
#include "tests/measure/report/section.h"

namespace hapticd::report {

// A plot is drawn as hapticctl draws its own.
using Plot = cli::FigurePanel;
using PlotAxis = cli::FigureAxis;
using PlotReference = cli::FigureReference;
using PlotSeries = cli::FigureSeries;
using PlotLine = PlotSeries::Line;
using PlotMark = PlotSeries::Mark;

/// A series of marks without a line; without a colour, that of its place among the series.
PlotSeries dots(std::string name, std::string color = {});

struct PlotSize {
  int width_px = 900;
  int height_px = 520;
};

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
  /// Writes NAME.gp, a script with the data in it, and has gnuplot draw NAME.svg of it. If gnuplot is missing
  /// or fails, the page says so.
  void add_plot(const std::string& name, const Plot& plot, const PlotSize& size = {});
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
