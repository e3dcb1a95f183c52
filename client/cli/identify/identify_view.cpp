#include "client/cli/identify/identify_view.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/cli/identify/identify_coverage.h"
#include "client/cli/plot/terminal_plot.h"
#include "client/cli/text/names.h"
#include "client/cli/text/progress_bar.h"
#include "client/cli/text/text_table.h"
#include "client/cli/text/uncertain_number.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

constexpr int kShortHash = 12;
constexpr int kTallRows = 30;
constexpr int kWidestFrame = 140;
constexpr int kMinPlotRows = 7;
constexpr double kUsualZeroBoundN = 0.25;  // contact.zero_bound_n of a scene that states none

std::string unit_of(const v1::EstimatedParameter& parameter) {
  return parameter.unit() == "1" ? "" : parameter.unit();
}

/// "4.1 %", two significant digits; "190 %" rather than with a power of ten.
std::string percent(double share) {
  if (!std::isfinite(share)) return "-";
  if (std::abs(share) >= 10.0) return share > 0.0 ? "> 1000 %" : "< -1000 %";
  return std::abs(share) < 0.995 ? fmt::format("{:.2g} %", 100.0 * share)
                                 : fmt::format("{:.0f} %", std::round(10.0 * share) * 10.0);
}

/// Coverage of the worst map.
double covered(const v1::IdentificationProgress& progress) {
  double share = 1.0;
  for (const auto& map : progress.coverage()) share = map.share() >= 0.0 ? std::min(share, map.share()) : 0.0;
  return share;
}

std::string duration(const v1::IdentificationProgress& progress) {
  return fmt::format("{:.1f} of {:g} s", progress.duration_s(), progress.time_limit_s());
}

std::string painted_state(const v1::IdentificationProgress& progress, const Terminal& terminal) {
  const std::string text = word(progress.state());
  switch (progress.state()) {
    case v1::IDENTIFICATION_STATE_CONVERGED:
      return terminal.paint(Color::kGreen, text);
    case v1::IDENTIFICATION_STATE_PARTIAL:
    case v1::IDENTIFICATION_STATE_CANCELLED:
      return terminal.paint(Color::kYellow, text);
    case v1::IDENTIFICATION_STATE_FAILED:
      return terminal.paint(Color::kRed, text);
    default:
      return terminal.paint(Color::kCyan, text);
  }
}

/// An important text, in a box of the given width.
std::vector<std::string> banner(const std::string& text, std::size_t width, Color color,
                                const Terminal& terminal) {
  const std::size_t inside = width > 8 ? width - 6 : 2;
  const bool u = terminal.unicode;
  std::string rule;
  for (std::size_t i = 0; i < inside + 4; ++i) rule += u ? "━" : "=";
  const auto painted = [&](const std::string& sign) { return terminal.paint(color, sign); };
  std::vector<std::string> lines{painted((u ? "┏" : "+") + rule + (u ? "┓" : "+"))};
  for (const auto& line : wrapped(text, inside)) {
    lines.push_back(painted(u ? "┃" : "|") + "  " +
                    terminal.bold(terminal.paint(color, padded(line, inside))) + "  " +
                    painted(u ? "┃" : "|"));
  }
  lines.push_back(painted((u ? "┗" : "+") + rule + (u ? "┛" : "+")));
  return lines;
}

std::string flag(const char* name, bool yes, const Terminal& terminal) {
  const std::string sign = terminal.unicode ? (yes ? "✔" : "✘") : (yes ? "+" : "-");
  return terminal.paint(yes ? Color::kGreen : Color::kGrey, sign + " " + name);
}

std::string flags(const v1::IdentificationProgress& progress, const Terminal& terminal) {
  const double share = covered(progress);
  std::string line =
      flag("steady", progress.steady(), terminal) + "   " + flag("certain", progress.certain(), terminal);
  if (progress.coverage_size() > 0) {
    const std::string text = fmt::format("covered {:.0f} %", std::floor(100.0 * share + 1e-9));
    line += "   " + flag(text.c_str(), share >= 1.0, terminal);
  }
  if (progress.has_residual()) line += "   residual " + percent(progress.residual());
  return line + fmt::format("   {} samples", progress.samples());
}

std::vector<std::string> parameter_lines(const v1::IdentificationProgress& progress, std::size_t at_most,
                                         const Terminal& terminal) {
  TextTable table({},
                  {Align::kLeft, Align::kRight, Align::kLeft, Align::kRight, Align::kLeft, Align::kRight});
  const auto count = static_cast<std::size_t>(progress.parameters_size());
  const std::size_t shown = count <= at_most ? count : std::max<std::size_t>(at_most, 1) - 1;
  for (std::size_t i = 0; i < shown; ++i) {
    const auto& parameter = progress.parameters(static_cast<int>(i));
    const UncertainText text =
        parameter_parts(parameter.name(), parameter.value(), parameter.standard_error(), terminal.unicode);
    const double relative = parameter.standard_error() / std::abs(parameter.value());
    const bool relation = !text.error.empty() && std::isfinite(relative);
    table.add({parameter.name(), text.value, text.error.empty() ? "" : (terminal.unicode ? "±" : "+-"),
               text.error, unit_of(parameter), relation ? "(" + percent(relative) + ")" : ""});
  }
  auto lines = table.lines(terminal, 2);
  if (shown < count) lines.push_back(fmt::format("  and {} more", count - shown));
  return lines;
}

/// "label   first" and the further ones below it; how many were left out.
std::vector<std::string> list_lines(const char* label,
                                    const google::protobuf::RepeatedPtrField<std::string>& texts, int at_most,
                                    Color color, const Terminal& terminal) {
  std::vector<std::string> lines;
  for (int i = 0; i < std::min(texts.size(), at_most); ++i) {
    lines.push_back("  " + terminal.paint(color, padded(i == 0 ? label : "", 9)) + printable(texts.Get(i)));
  }
  if (texts.size() > at_most && !lines.empty()) {
    // Rather the text is cut than how many there are.
    const std::string more = fmt::format("  (and {} more)", texts.size() - at_most);
    const auto room = static_cast<std::size_t>(std::max(terminal.width - static_cast<int>(more.size()), 0));
    if (display_width(lines.back()) > room) lines.back() = padded(lines.back(), room);
    lines.back() += more;
  }
  return lines;
}

void append(std::vector<std::string>& lines, const std::vector<std::string>& more) {
  lines.insert(lines.end(), more.begin(), more.end());
}

/// Draws coverage and fit in the room that is left.
std::vector<std::string> plots(const v1::IdentificationProgress& progress, int width, int rows,
                               const Terminal& terminal) {
  constexpr int kSideBySideWidth = 76;
  constexpr int kTallestPlot = 24;
  if (rows < kMinPlotRows) return {};
  const bool has_fit = progress.fit_size() > 0;
  const int maps = progress.coverage_size();
  const int height = std::min(rows, kTallestPlot);
  if (!has_fit && maps == 0) return {};

  if (width < kSideBySideWidth || !has_fit || maps == 0) {
    if (has_fit && (maps == 0 || rows < 2 * kMinPlotRows)) return draw_fit(progress, width, height, terminal);
    std::vector<std::string> lines;
    if (maps > 0) {
      lines = draw_coverage(progress.coverage(0), width, has_fit ? rows / 2 : height, terminal);
    }
    const int left = std::min(rows - static_cast<int>(lines.size()), kTallestPlot);
    if (has_fit && left >= kMinPlotRows) append(lines, draw_fit(progress, width, left, terminal));
    return lines;
  }
  const int left_width = width * 2 / 5;
  std::vector<std::string> left;
  // As many maps as there is room for, one below the other.
  const int fitting = std::clamp(height / kMinPlotRows, 1, maps);
  for (int i = 0; i < fitting; ++i) {
    append(left, draw_coverage(progress.coverage(i), left_width, height / fitting, terminal));
  }
  if (left.empty()) return draw_fit(progress, width, height, terminal);
  return side_by_side(left, draw_fit(progress, width - left_width - 2, height, terminal), 2);
}

std::vector<std::string> problem_lines(const v1::ErrorDetail& problem, const Terminal& terminal) {
  std::vector<std::string> lines{"  " + terminal.paint(Color::kRed, padded("problem", 9)) +
                                 printable(problem.what())};
  const auto line = [&lines](const char* label, const std::string& text) {
    if (!text.empty()) lines.push_back("  " + padded(label, 9) + printable(text));
  };
  line("where", problem.where());
  line("given", problem.value());
  line("accepted", problem.limit());
  line("remedy", problem.remedy());
  return lines;
}

/// Threshold that a scene would not take; nothing if it would, or if this is about something else.
std::optional<double> refused_threshold_n(const v1::IdentificationProgress& progress) {
  for (const auto& parameter : progress.parameters()) {
    if (parameter.name() == "threshold_n" && parameter.value() > kUsualZeroBoundN) return parameter.value();
  }
  return std::nullopt;
}

/// Lines on how to go on with the model.
std::vector<std::string> model_lines(const v1::IdentificationProgress& progress, bool adopted,
                                     const Terminal& terminal) {
  if (progress.model().empty()) return {"  " + padded("model", 9) + "none was kept"};
  const bool converged = progress.state() == v1::IDENTIFICATION_STATE_CONVERGED;
  const std::string hash = progress.model();
  const std::string brief = hash.substr(0, kShortHash);
  std::vector<std::string> lines{"  " + padded("model", 9) + terminal.bold(hash) +
                                 (converged ? "" : "  (kept, marked as not converged)")};
  lines.push_back("  " + padded("look", 9) + "hapticctl model show " + brief);
  if (const auto threshold_n = refused_threshold_n(progress)) {
    lines.push_back("  " + padded("not used", 9) +
                    fmt::format("a scene would not take a threshold of {:.2f} N, at most {:g} N unless its "
                                "contact.zero_bound_n is greater: identify again with the tool free",
                                *threshold_n, kUsualZeroBoundN));
  } else if (adopted && converged) {
    lines.push_back("  " + padded("in use", 9) + "tagged current: scenes use it from their next load on");
  } else {
    lines.push_back("  " + padded("use it", 9) + "hapticctl model tag " + brief +
                    " current   (scenes use it from their next load on)");
  }
  return lines;
}

TerminalSeries dots(const char* name, Color color) {
  return {name, color, TerminalSeries::Stroke::kLine, {}};
}

}  // namespace

bool is_over(const v1::IdentificationProgress& progress) {
  return progress.state() != v1::IDENTIFICATION_STATE_UNSPECIFIED &&
         progress.state() != v1::IDENTIFICATION_STATE_RUNNING;
}

std::string plot_label(const std::string& text) {
  const auto open = text.rfind(" [");
  if (open == std::string::npos || !text.ends_with(']')) return printable(text);
  const std::string unit = text.substr(open + 2, text.size() - open - 3);
  const bool compound = unit.find_first_of("/* ") != std::string::npos;
  return printable(text.substr(0, open) + (compound ? " / (" + unit + ")" : " / " + unit));
}

std::string identify_subject(const v1::IdentificationProgress& progress) {
  std::string text = progress.kind();
  std::replace(text.begin(), text.end(), '_', ' ');
  if (!progress.object().empty()) text += " of " + progress.object();
  if (!progress.recording().empty()) text += ", from the recording " + progress.recording();
  return printable(text);
}

bool is_of_earlier_run(const v1::IdentificationProgress& progress) {
  return is_over(progress) && !progress.has_time_limit_s();
}

std::vector<std::string> draw_fit(const v1::IdentificationProgress& progress, int width, int height,
                                  const Terminal& terminal) {
  TerminalSeries measured = dots("measured", Color::kCyan);
  TerminalSeries model = dots("model", Color::kYellow);
  // In the order of x the model is a curve; loops through time are not, at a few points.
  const bool ordered =
      std::is_sorted(progress.fit().begin(), progress.fit().end(),
                     [](const v1::FitPoint& a, const v1::FitPoint& b) { return a.x() < b.x(); });
  TerminalPlotFrame frame{
      plot_label(progress.fit_x()), plot_label(progress.fit_y()), {0.0, 0.0}, {0.0, 0.0}, width, height};
  bool any = false;
  for (const auto& point : progress.fit()) {
    if (!std::isfinite(point.x())) continue;
    for (const double y : {point.measured(), point.model()}) {
      if (!std::isfinite(y)) continue;
      const Range here_x{point.x(), point.x()};
      frame.x = any ? united(frame.x, here_x) : here_x;
      frame.y = any ? united(frame.y, {y, y}) : Range{y, y};
      any = true;
    }
    measured.points.push_back({point.x(), point.measured()});
    measured.points.push_back(kBreak);
    model.points.push_back({point.x(), point.model()});
    if (!ordered) model.points.push_back(kBreak);
  }
  if (!any) return {};
  frame.x = rounded(frame.x);
  frame.y = rounded(frame.y);
  return draw(frame, {measured, model}, terminal);
}

std::vector<std::string> identify_frame(const v1::IdentificationProgress& progress, const std::string& notice,
                                        const Terminal& terminal) {
  const int width = std::min(terminal.width, kWidestFrame);
  const int height = terminal.height - 1;
  const bool tall = height >= kTallRows;
  std::vector<std::string> lines{terminal.bold(printable(progress.identification())) + "  " +
                                 identify_subject(progress) + "  " + painted_state(progress, terminal)};
  const auto whole = static_cast<std::size_t>(std::max(width, 20));
  if (!notice.empty()) {
    append(lines, banner(notice, whole, Color::kRed, terminal));
  } else if (!is_over(progress) && !progress.instruction().empty()) {
    append(lines, banner(printable(progress.instruction()), whole, Color::kYellow, terminal));
  }
  if (!is_of_earlier_run(progress)) {
    lines.push_back(progress_bar(progress.completion(), std::clamp(width - 34, 10, 60), terminal) + " " +
                    percent_done(progress.completion()) + "   " + duration(progress));
    lines.push_back(flags(progress, terminal));
  }
  append(lines, parameter_lines(progress, tall ? 12 : 4, terminal));
  if (!is_over(progress)) {
    append(lines, list_lines("missing", progress.missing(), tall ? 4 : 1, Color::kYellow, terminal));
    append(lines, list_lines("remark", progress.remarks(), tall ? 3 : 1, Color::kGrey, terminal));
  }
  if (tall) lines.emplace_back();
  append(lines, plots(progress, width, height - static_cast<int>(lines.size()), terminal));
  return lines;
}

std::string identify_line(const v1::IdentificationProgress& progress, const Terminal& terminal) {
  if (is_of_earlier_run(progress)) return fmt::format("{:>7} s  {}", "-", word(progress.state()));
  std::string line = fmt::format("{:7.1f} s  {}  {}", progress.duration_s(), word(progress.state()),
                                 percent_done(progress.completion()));
  if (progress.has_residual()) line += "  residual " + percent(progress.residual());
  if (progress.coverage_size() > 0) {
    line += fmt::format("  covered {:.0f} %", std::floor(100.0 * covered(progress) + 1e-9));
  }
  if (!is_over(progress) && !progress.instruction().empty())
    line += "  > " + printable(progress.instruction());
  // Last: there may be many of them.
  for (const auto& parameter : progress.parameters()) {
    const std::string unit = unit_of(parameter);
    line += fmt::format(
        "  {} {}{}", parameter.name(),
        parameter_text(parameter.name(), parameter.value(), parameter.standard_error(), terminal.unicode),
        unit.empty() ? "" : " " + unit);
  }
  return printable(line);
}

std::vector<std::string> identify_report(const v1::IdentificationProgress& progress, bool adopted,
                                         const Terminal& terminal) {
  constexpr int kAll = 100;
  std::vector<std::string> lines{fmt::format("{}  {}: {}",
                                             terminal.bold(printable(progress.identification())),
                                             identify_subject(progress), painted_state(progress, terminal))};
  if (!is_of_earlier_run(progress)) {
    lines.front() += fmt::format(" after {:.1f} s", progress.duration_s());
    append(lines, parameter_lines(progress, kAll, terminal));
    lines.push_back("  " + flags(progress, terminal));
  }
  append(lines, list_lines("missing", progress.missing(), kAll, Color::kYellow, terminal));
  append(lines, list_lines("remark", progress.remarks(), kAll, Color::kGrey, terminal));
  if (progress.has_problem() && !progress.problem().what().empty()) {
    append(lines, problem_lines(progress.problem(), terminal));
  }
  append(lines, model_lines(progress, adopted, terminal));
  return lines;
}

}  // namespace hapticd::cli
