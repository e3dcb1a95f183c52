#include "client/cli/record/incident_figure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

constexpr std::size_t kMaxIncidentPoints = 4000;
constexpr double kMsPerS = 1000.0;

struct IncidentTrace {
  const char* column;
  const char* name;
  double scale = 1.0;
  double max = std::numeric_limits<double>::infinity();  ///< beyond there is nothing to show
};

constexpr IncidentTrace kForces[] = {{"sample_sensor_force_z_n", "sensor, z"},
                                     {"contact_reaction_force_n", "reaction"},
                                     {"control_hand_force_n", "hand, estimated"},
                                     {"control_commanded_force_n", "wanted of the device"}};
constexpr IncidentTrace kDeviceForces[] = {
    {"guard_device_command_x_n", "x"}, {"guard_device_command_y_n", "y"}, {"guard_device_command_z_n", "z"}};
constexpr IncidentTrace kTip[] = {
    {"sample_tip_position_x_mm", "x"}, {"sample_tip_position_y_mm", "y"}, {"sample_tip_position_z_mm", "z"}};
/// The sample of a sensor that is not in use is older than any time.
constexpr IncidentTrace kTimes[] = {{"sample_force_age_ms", "age of the sensor's sample", 1.0, kMsPerS},
                                    {"timing_wakeup_ns", "tick late by", 1e-6},
                                    {"timing_compute_ns", "computation", 1e-6},
                                    {"timing_device_ns", "device", 1e-6}};

std::vector<Point> points_of(const std::vector<double>& time_ms, const std::vector<double>& values,
                             const IncidentTrace& trace) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < time_ms.size(); ++i) {
    if (std::isfinite(values[i]) && trace.scale * values[i] <= trace.max) {
      points.push_back({time_ms[i], trace.scale * values[i]});
    } else if (!points.empty() && std::isfinite(points.back().x)) {
      points.push_back(kBreak);
    }
  }
  return thinned(points, kMaxIncidentPoints);
}

/// The cause as a line from the bottom of the curves to their top.
void mark_cause(FigurePanel& panel) {
  double low = 0.0;
  double high = 0.0;
  for (const FigureSeries& series : panel.series) {
    for (const Point& point : series.points) {
      if (!std::isfinite(point.y)) continue;
      low = std::min(low, point.y);
      high = std::max(high, point.y);
    }
  }
  if (high - low < 1e-9) high = low + 1.0;
  panel.series.push_back({"", "#d55e00", FigureSeries::Line::kDashed, {{0.0, low}, {0.0, high}}});
}

template <std::size_t N>
FigurePanel panel_of(const CsvTable& table, const std::vector<double>& time_ms, FigureAxis y,
                     const IncidentTrace (&traces)[N]) {
  FigurePanel panel{.y = std::move(y), .legend = FigurePanel::Legend::kAbove};
  std::size_t color = 0;
  for (const IncidentTrace& trace : traces) {
    const std::size_t own_color = color++;
    if (!table.has(trace.column)) continue;
    auto points = points_of(time_ms, table.column(trace.column), trace);
    if (points.empty()) continue;
    panel.series.push_back({trace.name, palette(own_color), FigureSeries::Line::kSolid, std::move(points)});
  }
  panel.x.minimum = time_ms.front();
  panel.x.maximum = std::max(time_ms.back(), time_ms.front() + 1e-3);
  return panel;
}

}  // namespace

Figure incident_figure(const CsvTable& table, const std::string& title, const std::string& cause,
                       double cause_s) {
  std::vector<double> time_ms = table.column("time_s");
  for (double& time : time_ms) time = kMsPerS * (time - cause_s);
  Figure figure{.title = title, .width_px = 1100, .height_px = 900, .notes = {cause + " (at 0 ms, dashed)"}};
  FigurePanel panels[] = {panel_of(table, time_ms, {"force", "N"}, kForces),
                          panel_of(table, time_ms, {"to the device", "N"}, kDeviceForces),
                          panel_of(table, time_ms, {"tip", "mm"}, kTip),
                          panel_of(table, time_ms, {"time", "ms"}, kTimes)};
  std::vector<FigurePanel> filled;
  for (FigurePanel& panel : panels) {
    if (!panel.series.empty()) filled.push_back(std::move(panel));
  }
  if (filled.empty()) {
    throw LocalError("there is nothing to draw in the incident", table.path(), "", "", "export it instead");
  }
  const double height = 0.95 / static_cast<double>(filled.size());
  for (std::size_t i = 0; i < filled.size(); ++i) {
    filled[i].bottom = 0.95 - static_cast<double>(i + 1) * height;
    filled[i].height = height;
    if (i + 1 == filled.size()) {
      filled[i].x.label = "time after the cause";
      filled[i].x.unit = "ms";
    }
    mark_cause(filled[i]);
    figure.panels.push_back(std::move(filled[i]));
  }
  return figure;
}

}  // namespace hapticd::cli
