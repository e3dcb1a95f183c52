#include "client/cli/view/watch_view.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/cli/plot/press_axis.h"
#include "client/cli/plot/terminal_plot.h"
#include "client/cli/view/live_state.h"

namespace hapticd::cli {
namespace {

using Quantity = std::optional<double>;
using Getter = Quantity (*)(const v1::TelemetrySample&);

Quantity displacement(const v1::TelemetrySample& s) {
  if (s.has_deformation()) return s.deformation().displacement_mm();
  return s.has_truth() ? Quantity(s.truth().displacement_mm()) : std::nullopt;
}
Quantity true_displacement(const v1::TelemetrySample& s) {
  return s.has_truth() ? Quantity(s.truth().displacement_mm()) : std::nullopt;
}
Quantity hand_force(const v1::TelemetrySample& s) {
  return s.has_control() ? Quantity(s.control().hand_force_n()) : std::nullopt;
}
Quantity true_hand_force(const v1::TelemetrySample& s) {
  return s.has_truth() ? Quantity(into_object(s.truth().hand_force_n())) : std::nullopt;
}
Quantity reaction_force(const v1::TelemetrySample& s) {
  return s.has_contact() ? Quantity(s.contact().reaction_force_n()) : std::nullopt;
}
Quantity target_stiffness(const v1::TelemetrySample& s) {
  return s.has_target() ? Quantity(s.target().target_stiffness_n_per_mm()) : std::nullopt;
}

double time_s(const v1::TelemetrySample& s) {
  return static_cast<double>(s.time_ns()) * 1e-9;
}

struct Channel {
  const char* name;
  Color color;
  Getter value;
  Getter over;  ///< what it is drawn over in the plot of force over displacement
};

// Drawn in this order: what matters most comes last and lies on top.
constexpr Channel kForces[] = {
    {"hand, true", Color::kGrey, true_hand_force, true_displacement},
    {"reaction", Color::kYellow, reaction_force, displacement},
    {"hand", Color::kCyan, hand_force, displacement},
};
constexpr Channel kDisplacements[] = {
    {"true", Color::kGrey, true_displacement, nullptr},
    {"displacement", Color::kGreen, displacement, nullptr},
};

/// The channel over time, or over another quantity.
TerminalSeries curve(const std::deque<v1::TelemetrySample>& samples, const Channel& channel, bool over_time) {
  TerminalSeries series{channel.name, channel.color, TerminalSeries::Stroke::kLine, {}};
  const double now_s = samples.empty() ? 0.0 : time_s(samples.back());
  for (const auto& sample : samples) {
    const Quantity y = channel.value(sample);
    const Quantity x = over_time ? Quantity(time_s(sample) - now_s) : channel.over(sample);
    series.points.push_back(x && y ? Point{*x, *y} : kBreak);
  }
  const bool nothing =
      std::none_of(series.points.begin(), series.points.end(), [](const Point& p) { return p.x == p.x; });
  if (nothing) series.points.clear();
  return series;
}

/// Round range that holds all points' `coordinate` and at least `at_least`.
Range range_of(const std::vector<TerminalSeries>& all, double Point::*coordinate, Range at_least) {
  for (const auto& series : all) {
    for (const Point& point : series.points) {
      const double value = point.*coordinate;
      if (value == value) at_least = united(at_least, {value, value});
    }
  }
  return rounded(at_least);
}

std::vector<TerminalSeries> curves(const std::deque<v1::TelemetrySample>& samples, const Channel* begin,
                                   const Channel* end, bool over_time) {
  std::vector<TerminalSeries> all;
  for (const Channel* channel = begin; channel != end; ++channel) {
    auto series = curve(samples, *channel, over_time);
    if (!series.points.empty()) all.push_back(std::move(series));
  }
  return all;
}

/// A linear target as its line. Any other has a force over displacement that changes with the depth: what was
/// asked for at the depths that were passed.
TerminalSeries target_curve(const std::deque<v1::TelemetrySample>& samples, double now_n_per_mm,
                            double max_displacement_mm) {
  constexpr double kNoticedChange = 0.01;
  TerminalSeries series{
      fmt::format("target {:.3g} N/mm", now_n_per_mm), Color::kMagenta, TerminalSeries::Stroke::kDashed, {}};
  bool bent = false;
  for (const auto& sample : samples) {
    const Quantity target = target_stiffness(sample);
    const Quantity depth = displacement(sample);
    if (!target || !depth || !(*depth > 0.0)) continue;
    bent = bent || std::abs(*target - now_n_per_mm) > kNoticedChange * now_n_per_mm;
    series.points.push_back({*depth, *depth * *target});
  }
  if (bent) {
    std::sort(series.points.begin(), series.points.end(),
              [](const Point& a, const Point& b) { return a.x < b.x; });
    series.name = fmt::format("target, {:.3g} N/mm now", now_n_per_mm);
  } else {
    series.points = {{0.0, 0.0}, {max_displacement_mm, max_displacement_mm * now_n_per_mm}};
  }
  return series;
}

std::vector<std::string> force_over_displacement(const std::deque<v1::TelemetrySample>& samples, int width,
                                                 int height, const Terminal& terminal) {
  auto all = curves(samples, std::begin(kForces), std::end(kForces), false);
  TerminalPlotFrame frame{"displacement / mm",
                          "force / N",
                          range_of(all, &Point::x, {0.0, 1.0}),
                          range_of(all, &Point::y, {0.0, 0.5}),
                          width,
                          height};
  if (const auto target = target_stiffness(samples.back()))
    all.insert(all.begin(), target_curve(samples, *target, frame.x.high));
  return draw(frame, all, terminal);
}

std::vector<std::string> over_time(const std::deque<v1::TelemetrySample>& samples, const Channel* begin,
                                   const Channel* end, const char* label, double window_s, int width,
                                   int height, const Terminal& terminal) {
  const auto all = curves(samples, begin, end, true);
  return draw({"time / s", label, {-window_s, 0.0}, range_of(all, &Point::y, {0.0, 0.5}), width, height}, all,
              terminal);
}

}  // namespace

void WatchView::add(const v1::TelemetrySample& sample) {
  samples_.push_back(sample);
  const auto window_ns = static_cast<std::int64_t>(window_s_ * 1e9);
  while (samples_.front().time_ns() < sample.time_ns() - window_ns) samples_.pop_front();
}

std::string WatchView::when() const {
  const auto& s = samples_.back();
  return fmt::format("{:9.3f} s  {:<10}", time_s(s), words(live_state(s)));
}

std::vector<std::string> WatchView::values() const {
  const auto& s = samples_.back();
  std::vector<std::string> values;
  const auto append = [&values](const char* name, const Quantity& value, const char* unit) {
    if (value) values.push_back(fmt::format("{} {:.3f} {}", name, *value, unit));
  };
  append("displacement", displacement(s), "mm");
  append("hand", hand_force(s), "N");
  append("reaction", reaction_force(s), "N");
  append("target", target_stiffness(s), "N/mm");
  append("true hand", true_hand_force(s), "N");
  return values;
}

std::string WatchView::line() const {
  return samples_.empty() ? "no telemetry yet" : fmt::format("{}  {}", when(), fmt::join(values(), "  "));
}

std::vector<std::string> WatchView::frame(const client::StreamAccount& account,
                                          const Terminal& terminal) const {
  if (samples_.empty()) return {line()};
  const std::string loss =
      account.complete()
          ? terminal.paint(Color::kGrey, "  no gaps")
          : terminal.paint(Color::kRed, fmt::format("  {} samples missing", account.missing()));
  // A number cut in half reads as another number: what has no room goes to the next line.
  std::vector<std::string> lines{terminal.bold(when()) + loss};
  for (const std::string& value : values()) {
    if (display_width(lines.back()) + 2 + display_width(value) > static_cast<std::size_t>(terminal.width)) {
      lines.emplace_back();
    }
    lines.back() += "  " + value;
  }
  constexpr int kWideColumns = 110;
  constexpr int kTallRows = 34;
  const int rows = std::clamp(terminal.height - 2 - static_cast<int>(lines.size()), 8, 44);
  const auto forces = [&](int width, int height) {
    return over_time(samples_, std::begin(kForces), std::end(kForces), "force / N", window_s_, width, height,
                     terminal);
  };
  const auto displacements = [&](int width, int height) {
    return over_time(samples_, std::begin(kDisplacements), std::end(kDisplacements), "displacement / mm",
                     window_s_, width, height, terminal);
  };
  const auto append = [&lines](const std::vector<std::string>& more) {
    lines.insert(lines.end(), more.begin(), more.end());
  };

  if (terminal.width >= kWideColumns) {
    const int left = terminal.width / 2 - 1;
    const int right = terminal.width - left - 3;
    const int height = std::min(rows, 32);
    auto strips = forces(right, height - height / 2);
    for (auto& more : displacements(right, height / 2)) strips.push_back(std::move(more));
    append(side_by_side(force_over_displacement(samples_, left, height, terminal), strips, 2));
  } else if (rows >= kTallRows) {
    append(force_over_displacement(samples_, terminal.width, rows / 2, terminal));
    append(forces(terminal.width, rows / 4));
    append(displacements(terminal.width, rows / 4));
  } else if (rows >= kTallRows / 2) {
    append(force_over_displacement(samples_, terminal.width, rows * 3 / 5, terminal));
    append(forces(terminal.width, rows * 2 / 5));
  } else {
    append(force_over_displacement(samples_, terminal.width, rows, terminal));
  }
  return lines;
}

}  // namespace hapticd::cli
