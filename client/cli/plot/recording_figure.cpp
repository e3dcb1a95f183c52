#include "client/cli/plot/recording_figure.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

constexpr std::size_t kMaxPoints = 8000;
constexpr double kNoticedShiftMm = 0.2;
constexpr double kTouchedAgainS = 0.3;
constexpr double kBounceS = 0.1;  // a contact that is shorter does not count as a press
constexpr double kAbsurd = 1e30;  // no force, length or time; axes over such would overflow
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A column of a recording and how it is drawn.
struct Trace {
  const char* column;
  const char* name;
  const char* color;
  double sign = 1.0;
};

// The truth first: estimates that are right lie on it.
constexpr Trace kForceTraces[] = {{"truth_hand_force_z_n", "hand, true", "#333333", -1.0},
                                  {"contact_reaction_force_n", "reaction", "#e69f00"},
                                  {"control_hand_force_n", "hand, estimated", "#0072b2"},
                                  {"control_commanded_force_n", "device, commanded", "#cc79a7"}};
constexpr Trace kDisplacementTraces[] = {{"truth_displacement_mm", "true", "#333333"},
                                         {"deformation_displacement_mm", "estimated", "#009e73"}};
constexpr Trace kTarget{"target_stiffness_n_per_mm", "target", "#d55e00"};

bool is_truth(const Trace& trace) {
  return std::string_view(trace.column).starts_with("truth_");
}

/// If a column says no (0), the values are NaN; without such a column, all are kept.
std::vector<double> where(const CsvTable& table, const char* condition, std::vector<double> values) {
  if (!table.has(condition)) return values;
  const std::vector<double>& holds = table.column(condition);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(holds[i] > 0.5)) values[i] = kNone;
  }
  return values;
}

std::vector<Point> points(const std::vector<double>& x, const std::vector<double>& y, double sign) {
  std::vector<Point> result;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool there = std::abs(x[i]) < kAbsurd && std::abs(y[i]) < kAbsurd;  // not NaN either
    const bool after_break = result.empty() || !std::isfinite(result.back().x);
    if (there) {
      result.push_back({x[i], sign * y[i]});
    } else if (!after_break) {
      result.push_back(kBreak);
    }
  }
  return thinned(result, kMaxPoints);
}

void add_trace(FigurePanel& panel, const CsvTable& table, const std::vector<double>& x, const Trace& trace,
               FigureSeries::Line line) {
  if (!table.has(trace.column)) return;
  FigureSeries series{trace.name, trace.color, line, points(x, table.column(trace.column), trace.sign)};
  if (!series.points.empty()) panel.series.push_back(std::move(series));
}

/// What is seen of the contacts of a recording.
struct Contacts {
  double true_deeper_mm = 0.0;  ///< by so much at most the truth begins deeper than the estimate
  bool touched_again = false;   ///< a contact began right after another one
};

Contacts contacts_of(const CsvTable& table) {
  Contacts seen;
  if (!table.has("contact_in_contact") || !table.has("time_s")) return seen;
  const std::vector<double>& touches = table.column("contact_in_contact");
  const std::vector<double>& time_s = table.column("time_s");
  const bool both = table.has("truth_displacement_mm") && table.has("deformation_displacement_mm");
  double began_s = time_s.front();
  double press_ended_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < touches.size(); ++i) {
    const bool now = touches[i] > 0.5;
    const bool before = touches[i - 1] > 0.5;
    if (before && !now && time_s[i] - began_s > kBounceS) press_ended_s = time_s[i];
    if (before || !now) continue;
    began_s = time_s[i];
    const bool again = time_s[i] - press_ended_s < kTouchedAgainS;
    seen.touched_again = seen.touched_again || again;
    // One that is touched again has not been let go of: its own count says nothing about the object.
    if (both && !again) {
      const double deeper_mm =
          table.column("truth_displacement_mm")[i] - table.column("deformation_displacement_mm")[i];
      if (deeper_mm > seen.true_deeper_mm) seen.true_deeper_mm = deeper_mm;
    }
  }
  return seen;
}

std::vector<std::string> notes_on(const Contacts& seen) {
  std::vector<std::string> notes;
  if (seen.true_deeper_mm > kNoticedShiftMm) {
    notes.push_back(
        fmt::format("True curves are up to {:.1f} mm to the right: the object had not recovered from the "
                    "press before (it creeps), and the estimate begins at 0 where it is touched.",
                    seen.true_deeper_mm));
  }
  if (seen.touched_again) {
    notes.push_back(
        "On letting go the object recovers more slowly than the hand lifts: as its reaction fades, so does "
        "the "
        "force, and the tip comes free at depth. Touched again, the estimate counts from 0.");
  }
  return notes;
}

FigurePanel curve_panel(const CsvTable& table) {
  const bool estimated = table.has("deformation_displacement_mm");
  // If one of the two displacements is missing, all is plotted over the other.
  const char* over = estimated ? "deformation_displacement_mm" : "truth_displacement_mm";
  const std::vector<double> displacement = where(
      table, table.has("contact_in_contact") ? "contact_in_contact" : "truth_in_contact", table.column(over));
  FigurePanel curve{.title = "Force over displacement, while touching",
                    .x = {"displacement", "mm"},
                    .y = {"force", "N"},
                    .left = 0.0,
                    .bottom = 0.0,
                    .width = 0.5,
                    .height = 0.95,
                    .legend = FigurePanel::Legend::kBelow};
  for (const Trace& trace : kForceTraces) {
    const bool over_truth = is_truth(trace) && table.has("truth_displacement_mm");
    add_trace(
        curve, table,
        over_truth ? where(table, "truth_in_contact", table.column("truth_displacement_mm")) : displacement,
        trace, FigureSeries::Line::kSolid);
  }
  return curve;
}

}  // namespace

Figure recording_figure(const CsvTable& table) {
  std::vector<double> time_s = table.column("time_s");
  for (double& t : time_s) t -= table.column("time_s").front();
  const double end_s = std::max(time_s.back(), 1e-3);
  const FigureAxis unnamed_time{.minimum = 0.0, .maximum = end_s};

  const bool has_displacement =
      table.has("deformation_displacement_mm") || table.has("truth_displacement_mm");
  FigurePanel curve = has_displacement ? curve_panel(table) : FigurePanel{};
  // If nothing was touched, there are no curves. The panels over time then have the whole width and a key.
  const bool touched = !curve.series.empty();
  const double left = touched ? 0.5 : 0.0;
  const double width = 1.0 - left;
  FigurePanel forces{.title = touched ? "Over time (forces in the colours of the left)" : "",
                     .x = unnamed_time,
                     .y = {"force", "N"},
                     .left = left,
                     .bottom = 0.64,
                     .width = width,
                     .height = 0.31,
                     .legend = touched ? FigurePanel::Legend::kUpperLeft : FigurePanel::Legend::kAbove};
  for (Trace trace : kForceTraces) {
    if (touched) trace.name = "";
    add_trace(forces, table, time_s, trace, FigureSeries::Line::kThin);
  }
  FigurePanel depth{.title = "",
                    .x = unnamed_time,
                    .y = {"displacement", "mm"},
                    .left = left,
                    .bottom = 0.34,
                    .width = width,
                    .height = 0.31,
                    .legend = FigurePanel::Legend::kAbove};
  for (const Trace& trace : kDisplacementTraces)
    add_trace(depth, table, time_s, trace, FigureSeries::Line::kThin);
  FigurePanel target{.title = "",
                     .x = {.label = "time", .unit = "s", .minimum = 0.0, .maximum = end_s},
                     .y = {"stiffness", "N/mm"},
                     .left = left,
                     .bottom = 0.0,
                     .width = width,
                     .height = 0.35,
                     .legend = FigurePanel::Legend::kAbove};
  add_trace(target, table, time_s, kTarget, FigureSeries::Line::kSolid);

  Figure figure{.title = std::filesystem::path(table.path()).filename().string(),
                .width_px = 1200,
                .height_px = 700,
                .notes = notes_on(contacts_of(table))};
  if (has_displacement && !touched)
    figure.notes.emplace_back("No contact was declared while this was recorded.");
  for (FigurePanel* panel : {&curve, &forces, &depth, &target}) {
    if (!panel->series.empty()) figure.panels.push_back(std::move(*panel));
  }
  if (figure.panels.empty()) {
    throw LocalError("there is nothing to draw in the recording", table.path(), "", "",
                     "record with the groups contact, deformation and control, or truth");
  }
  return figure;
}

}  // namespace hapticd::cli
