#include "tests/measure/report/svg_plot.h"

#include <array>
#include <charconv>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "tests/measure/report/child_process.h"

namespace hapticd::report {
namespace {

// Reported apart by readers with any colour vision, and in grey (after Okabe and Ito).
constexpr std::array<std::string_view, 8> kPalette{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                   "#56B4E9", "#E69F00", "#5A4FCF", "#4D4D4D"};
constexpr std::array<int, 6> kPointTypes{7, 5, 9, 11, 13, 6};

std::string shortest(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// A string literal of gnuplot; inside single quotes only the quote itself has a meaning.
std::string gp_text(std::string_view text) {
  std::string literal = "'";
  for (const char c : text) literal += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
  return literal + "'";
}

std::string csv_text(std::string_view text) {
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
  return field + "\"";
}

std::string title_of(const PlotAxis& axis) {
  return axis.unit.empty() ? axis.label : axis.label + " [" + axis.unit + "]";
}

std::string bound(const std::optional<double>& value) {
  return value ? shortest(*value) : "*";
}

/// One block a series, parted by two empty lines: gnuplot's index, and no row to a CSV reader.
std::string data_of(const SvgPlot& plot) {
  std::ostringstream data;
  data << "series," << csv_text(title_of(plot.x)) << ',' << csv_text(title_of(plot.y)) << '\n';
  bool first = true;
  for (const PlotSeries& series : plot.series) {
    if (series.x.size() != series.y.size())
      throw std::invalid_argument("series '" + series.label + "': x and y differ in length");
    if (!first) data << "\n\n";
    first = false;
    // gnuplot counts blocks: one without a point must exist all the same.
    if (series.x.empty()) data << csv_text(series.label) << ",nan,nan\n";
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      data << csv_text(series.label) << ',' << shortest(series.x[i]) << ',' << shortest(series.y[i]) << '\n';
    }
  }
  return data.str();
}

void write_axis(std::ostringstream& script, char letter, const PlotAxis& axis) {
  script << "set " << letter << "label " << gp_text(title_of(axis)) << '\n';
  script << "set " << letter << "range [" << bound(axis.minimum) << ':' << bound(axis.maximum) << "]\n";
  if (axis.logarithmic) script << "set logscale " << letter << "\nset format " << letter << " '%g'\n";
  if (axis.categories.empty()) return;
  script << "set " << letter << "tics (";
  for (std::size_t i = 0; i < axis.categories.size(); ++i) {
    script << (i > 0 ? ", " : "") << gp_text(axis.categories[i]) << ' ' << i;
  }
  script << ")\n";
  if (!axis.minimum && !axis.maximum) {
    script << "set " << letter
           << "range [-0.5:" << shortest(static_cast<double>(axis.categories.size()) - 0.5) << "]\n";
  }
  if (letter == 'x') script << "set xtics rotate by 25 right\n";
}

void write_reference(std::ostringstream& script, const PlotReference& reference) {
  const std::string at = shortest(reference.value);
  const bool across = reference.axis == PlotReference::Axis::kY;
  const std::string from = across ? "graph 0, first " + at : "first " + at + ", graph 0";
  const std::string to = across ? "graph 1, first " + at : "first " + at + ", graph 1";
  script << "set arrow from " << from << " to " << to << " nohead back dashtype (8,5) linecolor '#777777'\n";
  if (reference.label.empty()) return;
  const std::string place = across ? "graph 0.99, first " + at + " right offset 0,0.5"
                                   : "first " + at + ", graph 0.97 left offset 0.6,0";
  script << "set label " << gp_text(reference.label) << " at " << place << " textcolor '#555555' front\n";
}

std::string curve_of(const PlotSeries& series, std::size_t index, const std::string& data_name,
                     std::size_t& next_colour) {
  const std::size_t colour = series.colour ? static_cast<std::size_t>(*series.colour) : next_colour++;
  std::ostringstream curve;
  curve << gp_text(data_name) << " index " << index << " using 2:3 ";
  switch (series.style) {
    case PlotSeries::Style::kLine:
      curve << "with lines";
      break;
    case PlotSeries::Style::kPoints:
      curve << "with points";
      break;
    case PlotSeries::Style::kLinePoints:
      curve << "with linespoints";
      break;
  }
  curve << " linewidth 1.8 linecolor '" << kPalette[colour % kPalette.size()] << '\'';
  if (series.style != PlotSeries::Style::kPoints) curve << " dashtype " << (series.dashed ? "(10,6)" : "1");
  if (series.style != PlotSeries::Style::kLine) {
    curve << " pointtype " << series.point_type.value_or(kPointTypes[colour % kPointTypes.size()])
          << " pointsize " << shortest(series.point_size);
  }
  curve << (series.label.empty() ? " notitle" : " title " + gp_text(series.label));
  return curve.str();
}

std::string script_of(const SvgPlot& plot, const std::string& name) {
  std::ostringstream script;
  script << "# Draws " << name << ".svg from " << name << ".csv: gnuplot " << name << ".gp\n"
         << "set terminal svg size " << plot.width_px << ',' << plot.height_px
         << " noenhanced font 'DejaVu Sans,13' background 'white' rounded linewidth 1\n"
         << "set output " << gp_text(name + ".svg") << '\n'
         << "set encoding utf8\n"
         << "set datafile separator ','\n"
         << "set title " << gp_text(plot.title) << " font 'DejaVu Sans,15'\n"
         << "set border 3 linecolor '#444444'\n"
         << "set tics nomirror out textcolor '#222222'\n"
         << "set grid linecolor '#E3E3E3' linetype 1 linewidth 1\n"
         << "set key outside right top vertical Left reverse samplen 2 spacing 1.15\n";
  write_axis(script, 'x', plot.x);
  write_axis(script, 'y', plot.y);
  for (const PlotReference& reference : plot.references) write_reference(script, reference);
  std::size_t next_colour = 0;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    script << (i == 0 ? "plot " : "     ") << curve_of(plot.series[i], i, name + ".csv", next_colour)
           << (i + 1 < plot.series.size() ? ", \\\n" : "\n");
  }
  return script.str();
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::trunc | std::ios::binary);
  stream << text;
  stream.flush();
  if (!stream) throw std::runtime_error("cannot write '" + path.string() + "'");
}

}  // namespace

std::optional<std::string> draw(const SvgPlot& plot, const std::filesystem::path& folder,
                                const std::string& name) {
  std::filesystem::create_directories(folder);
  write_file(folder / (name + ".csv"), data_of(plot));
  write_file(folder / (name + ".gp"), script_of(plot, name));
  if (plot.series.empty()) return name + ".svg was not drawn: there is no series to draw";

  const ProgramRun run =
      run_program({.command = {"gnuplot", name + ".gp"}, .folder = folder}, std::chrono::seconds(60));
  const std::string again = "; " + name + ".csv and " + name + ".gp are written";
  if (!run.installed) {
    return name + ".svg was not drawn: gnuplot is not installed" + again +
           "; apt-get install gnuplot-nox, then: gnuplot " + name + ".gp";
  }
  if (run.status != 0) return name + ".svg was not drawn: gnuplot says: " + run.output + again;
  return std::nullopt;
}

}  // namespace hapticd::report
