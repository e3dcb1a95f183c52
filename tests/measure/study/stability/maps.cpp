#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/measure/study/common/palpation.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/stability/scaled_object.h"
#include "tests/measure/study/stability/stability_trial.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

// A flat object whose law is nearly straight, so that one number shows its stiffness.
constexpr const char* kTapped = "rubber_eraser";
constexpr const char* kExplored = "rubber_ball_3d";
constexpr double kStiffestTarget = 1000.0;  // that a scene takes
constexpr double kPlainEnd = 60.0;          // of a search, if the device is taken as rigid

const std::vector<std::string>& devices() {
  static const std::vector<std::string> names = sim::device_preset_names();
  return names;
}

std::vector<double> log_grid(double from, double to, std::size_t count) {
  std::vector<double> grid;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count - 1);
    grid.push_back(i + 1 == count ? to : from * std::pow(to / from, share));
  }
  return grid;
}

std::vector<double> object_stiffnesses(bool quick) {
  return quick ? std::vector<double>{0.5, 10.0} : log_grid(0.05, 1000.0, 14);
}

StabilityTrial scaled_tap(const std::string& device, double k, bool compensated, double rate_hz = 1000.0) {
  StabilityTrial trial = tap_trial(device, scaled_object(kTapped, k), rate_hz);
  trial.scene.structural_compensation = compensated;
  // What the simulated device takes to act is a tick of its loop, if that is faster than 1 kHz.
  trial.rig.custom_device->command_latency_s = std::min(1e-3, 1.0 / rate_hz);
  return trial;
}

StabilityTrial scaled_explore(const std::string& device, double k, bool passivity) {
  StabilityTrial trial = explore_trial(device, scaled_object(kExplored, k),
                                       scaled_model(identified(kExplored).model, kExplored, k));
  trial.scene.explore.passivity = passivity;
  return trial;
}

/// One way to run the loop.
struct Variant {
  const char* name;
  bool as_shipped;
  StabilityTrial (*trial)(const std::string& device, double object_n_per_mm);
};

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all{
      {"tap_1d", true, [](const std::string& device, double k) { return scaled_tap(device, k, true); }},
      {"tap_1d, taken as rigid", false,
       [](const std::string& device, double k) { return scaled_tap(device, k, false); }},
      {"tap_1d, taken as rigid, 5 kHz", false,
       [](const std::string& device, double k) { return scaled_tap(device, k, false, 5000.0); }},
      {"explore_bearing", true,
       [](const std::string& device, double k) { return scaled_explore(device, k, true); }},
      {"explore_bearing, no passivity control", false,
       [](const std::string& device, double k) { return scaled_explore(device, k, false); }}};
  return all;
}

/// How far the search goes: to what can be compensated if the target is solved for, else well beyond the
/// object.
double search_end(const StabilityTrial& trial) {
  return std::min(
      {compensable_n_per_mm(trial), kStiffestTarget, std::max(kPlainEnd, 4.0 * trial.object_n_per_mm())});
}

/// Cell of a boundary; empty if no feasible target is granted.
std::vector<double> boundary_cell(const StabilityTrial& trial, double octaves) {
  const double floor = softest_feasible_n_per_mm(trial);
  const double end = search_end(trial);
  if (floor >= end) return {};
  return values_of(
      find_stable_range(trial, floor, std::clamp(trial.object_n_per_mm(), floor, end), end, octaves));
}

std::string shown(const StableRange& range) {
  if (!range.any()) return "none";
  return (range.max_found ? "" : "≥ ") + significant(range.max_n_per_mm, 3);
}

// ---------------------------------------------------------------- what is granted, on the presets

struct Granted {
  std::string device, scene, object, hand;
  StabilityTrial trial;
};

std::vector<Granted> granted_cases(bool quick) {
  std::vector<Granted> all;
  for (const std::string& device : devices()) {
    std::vector<std::string> tapped = tapped_objects();
    tapped.emplace_back("wood_plate");
    for (const std::string& object : tapped) {
      if (quick && object != "sponge_block" && object != "wood_plate") continue;
      for (const bool weight : {false, true}) {
        StabilityTrial trial = tap_trial(device, sim::object_preset(object).value());
        trial.weight = weight;
        all.push_back({device, "tap_1d", object, weight ? "weight" : "hand", trial});
      }
    }
    for (const std::string& object : explored_objects()) {
      if (quick && object != kExplored) continue;
      all.push_back({device, "explore_bearing", object, "hand",
                     explore_trial(device, sim::object_preset(object).value(), identified(object).model)});
    }
  }
  return all;
}

/// All that is granted and feasible, evenly on the logarithm.
std::vector<double> granted_targets(const StabilityTrial& trial, std::size_t count) {
  const double low = softest_feasible_n_per_mm(trial);
  const double high = granted_n_per_mm(trial);
  return low < high ? log_grid(low, high, count) : std::vector<double>{};
}

/// "1.8 … 2.8 contact lost; …": neighbours of one class together.
std::string unstable_ranges(const std::vector<double>& grid, const std::vector<StabilityClass>& verdicts) {
  std::string text;
  for (std::size_t from = 0; from < grid.size();) {
    std::size_t to = from;
    while (to + 1 < grid.size() && verdicts[to + 1] == verdicts[from]) ++to;
    if (!is_stable(verdicts[from])) {
      if (!text.empty()) text += "; ";
      text += significant(grid[from], 2);
      if (to > from) text += " … " + significant(grid[to], 2);
      text += " " + std::string(to_text(verdicts[from]));
    }
    from = to + 1;
  }
  return text;
}

void run_granted(StudyContext& context) {
  const std::vector<Granted> cases = granted_cases(context.quick);
  const std::size_t targets = context.quick ? 3 : 16;
  const auto cells = context.cells.values("stability_granted", cases.size() * targets, [&](std::size_t cell) {
    const Granted& granted = cases[cell / targets];
    const std::vector<double> grid = granted_targets(granted.trial, targets);
    if (grid.empty()) return std::vector<double>{};
    const TrialOutcome outcome = run_trial(granted.trial, grid[cell % targets]);
    return std::vector<double>{static_cast<double>(outcome.verdict), outcome.swing_mm, outcome.swing_n,
                               outcome.at_full_pull ? 1.0 : 0.0};
  });
  if (!cells) return;
  report::MarkdownTable table({"device", "scene", "object", "N/mm", "by", "granted N/mm", "unstable",
                               "at full pull", "which are unstable, and what happens"});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Granted& granted = cases[i];
    const std::vector<double> grid = granted_targets(granted.trial, targets);
    std::vector<StabilityClass> verdicts;
    for (std::size_t j = 0; j < grid.size(); ++j) {
      verdicts.push_back(static_cast<StabilityClass>(static_cast<int>((*cells)[i * targets + j].at(0))));
    }
    const auto unstable = static_cast<std::size_t>(
        std::count_if(verdicts.begin(), verdicts.end(), [](StabilityClass c) { return !is_stable(c); }));
    std::size_t held = 0;
    for (std::size_t j = 0; j < verdicts.size(); ++j) {
      if (is_stable(verdicts[j]) && (*cells)[i * targets + j].at(3) > 0.5) ++held;
    }
    report::Figure figure{"granted_targets_unstable",
                          {{"device", granted.device},
                           {"scene", granted.scene},
                           {"object", granted.object},
                           {"by", granted.hand}}};
    figure.goal = 0.0;
    figure.source = "of targets spread evenly on the logarithm over all that is feasible (3.8) and granted";
    if (grid.empty()) {
      figure.failed = "no feasible target is granted";
    } else {
      figure.value = static_cast<double>(unstable) / static_cast<double>(grid.size());
    }
    context.report.add(figure);
    table.add_row(
        {granted.device, granted.scene, granted.object, significant(granted.trial.object_n_per_mm(), 3),
         granted.hand,
         grid.empty() ? "none feasible" : significant(grid.front(), 2) + " … " + significant(grid.back(), 3),
         grid.empty() ? report::kNoNumber : std::to_string(unstable) + " of " + std::to_string(grid.size()),
         grid.empty() ? report::kNoNumber : std::to_string(held) + " of " + std::to_string(grid.size()),
         unstable_ranges(grid, verdicts)});
  }
  context.report.add_table(
      "stability_granted", "Every target that hapticd grants: is it stable?", table,
      std::string(
          "Scenes and gains as shipped, 1 kHz, seed 1. Granted: from the softest target that "
          "(3.8) and the sensor's 35 N leave feasible under 4 N to the stiffest that a request is "
          "given, the device's largest (rt/target/largest_target.h). Unstable: how many of so many "
          "targets in between. At full pull: how many of them end at the largest force with which the "
          "device may press the tool in: the object is stable and feels stiffer than was asked. ") +
          kTrialInWords);
}

// ---------------------------------------------------------------- boundaries

/// The margins of what is granted of one loop as it ships on one object.
void add_margins(StudyContext& context, const std::string& device, const Variant& variant, double k,
                 const report::CellValues& values) {
  const StabilityTrial trial = variant.trial(device, k);
  const double granted = granted_n_per_mm(trial);
  for (const auto& [name, target] :
       {std::pair{"half the object's", 0.5 * k}, {"the object's own", k}, {"stiffest granted", granted}}) {
    report::Figure figure{"stability_margin",
                          {{"device", device},
                           {"object_stiffness", std::stod(significant(k, 3))},
                           {"target", name},
                           {"options", variant.name}}};
    figure.goal = 1.0;
    figure.source =
        "factor from the target to the nearer end of the stable range, or to the end of the search; below 1 "
        "it is "
        "unstable itself";
    if (values.empty() || target < softest_feasible_n_per_mm(trial)) {
      figure.failed = "not feasible under 4 N (3.8)";
    } else if (target > 1.001 * granted) {
      figure.failed = "not granted";
    } else if (const StableRange range = range_of(values); range.any()) {
      figure.value = range.margin(target);
    } else {
      figure.failed = "no stable target: " + std::string(to_text(range.at_start));
    }
    context.report.add(figure);
  }
}

void run_boundaries(StudyContext& context) {
  const std::vector<double> objects = object_stiffnesses(context.quick);
  const std::size_t of_device = variants().size() * objects.size();
  const auto values =
      context.cells.values("stability_boundaries", devices().size() * of_device, [&](std::size_t cell) {
        const Variant& variant = variants()[cell % of_device / objects.size()];
        return boundary_cell(variant.trial(devices()[cell / of_device], objects[cell % objects.size()]),
                             context.quick ? 1.0 / 4.0 : 1.0 / 16.0);
      });
  if (!values) return;
  std::vector<std::string> headers{"device", "loop"};
  for (const double k : objects) headers.push_back("k = " + significant(k, 2));
  report::MarkdownTable table(headers);
  std::size_t cell = 0;
  for (const std::string& device : devices()) {
    for (const Variant& variant : variants()) {
      std::vector<std::string> row{device, variant.name};
      for (const double k : objects) {
        const report::CellValues& found = (*values)[cell++];
        row.push_back(found.empty() ? report::kNoNumber : shown(range_of(found)));
        if (variant.as_shipped) add_margins(context, device, variant, k, found);
      }
      table.add_row(row);
    }
  }
  context.report.add_table(
      "stability_boundary", "Largest stable target, N/mm, over the object's stiffness k, N/mm", table,
      std::string("≥: stable to the end of the search (0.8 of the structural stiffness where tap_1d "
                  "compensates it, else 60 N/mm or four times the object). none: not even the object's own "
                  "stiffness, nor anything feasible below or four times above it. –: no feasible target is "
                  "granted. Objects: ") +
          kTapped + " (tap_1d) and " + kExplored +
          " (explore_bearing, with its identified law), the same force at a displacement smaller by the "
          "factor of stiffness, relaxation times kept, viscosity growing as k^0.6 (assumed, between the "
          "presets' sponge and wood). Latency: a tick, at most 1 ms. " +
          kTrialInWords);
}

// ---------------------------------------------------------------- class maps

void set_axes(report::SvgPlot& plot, double lowest, double highest) {
  plot.x = {"object stiffness", "N/mm", true, 0.04, 1250.0};
  plot.y = {"target stiffness", "N/mm", true, lowest, highest};
}

report::PlotSeries line_over(const std::vector<double>& objects, const std::string& label, int colour,
                             bool dashed, const std::function<double(double)>& value) {
  report::PlotSeries series{label, objects, {}, report::PlotSeries::Style::kLine, colour, dashed};
  for (const double k : objects) series.y.push_back(value(k));
  return series;
}

struct MapKind {
  std::string device;
  bool compensated = true;
};

void run_class_maps(StudyContext& context) {
  const std::vector<double> objects =
      context.quick ? std::vector<double>{0.5, 10.0} : log_grid(0.05, 1000.0, 18);
  const std::size_t targets = context.quick ? 3 : 16;
  std::vector<MapKind> maps;
  for (const std::string& device : devices()) {
    maps.push_back({device, true});
    maps.push_back({device, false});
  }
  const auto grid_of = [targets](const MapKind& map) {
    constexpr double kPlainMapEnd = 20.0;
    return log_grid(
        0.05, std::min(kPlainMapEnd, compensable_n_per_mm(scaled_tap(map.device, 1.0, map.compensated))),
        targets);
  };
  const std::size_t of_map = objects.size() * targets;
  const auto cells = context.cells.values("stability_classes", maps.size() * of_map, [&](std::size_t cell) {
    const MapKind& map = maps[cell / of_map];
    const StabilityTrial trial = scaled_tap(map.device, objects[cell % of_map / targets], map.compensated);
    return std::vector<double>{static_cast<double>(run_trial(trial, grid_of(map)[cell % targets]).verdict)};
  });
  if (!cells) return;
  constexpr std::array<int, kStabilityClasses> kColours{2, 4, 5, 1, 3, 6, 7};
  report::MarkdownTable table({"device", "structure", "class", "feasible cells", "infeasible cells"});
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const std::vector<double> grid = grid_of(maps[m]);
    report::SvgPlot plot;
    plot.title = maps[m].device + ", tap_1d " + (maps[m].compensated ? "as shipped" : "taken as rigid") +
                 ": class of every target";
    set_axes(plot, 0.04, 1.3 * grid.back());
    const auto feasible = [&](double k) {
      return softest_feasible_n_per_mm(scaled_tap(maps[m].device, k, maps[m].compensated));
    };
    for (std::size_t c = 0; c < kStabilityClasses; ++c) {
      const auto of_class = static_cast<StabilityClass>(c);
      report::PlotSeries series{
          std::string(to_text(of_class)), {}, {}, report::PlotSeries::Style::kPoints, kColours[c]};
      series.point_type = 5;
      series.point_size = 1.3;
      report::PlotSeries small = series;
      small.label.clear();
      small.point_size = 0.5;
      for (std::size_t o = 0; o < objects.size(); ++o) {
        for (std::size_t t = 0; t < targets; ++t) {
          if (static_cast<std::size_t>((*cells)[m * of_map + o * targets + t].at(0)) != c) continue;
          report::PlotSeries& of = grid[t] < feasible(objects[o]) ? small : series;
          of.add(objects[o], grid[t]);
        }
      }
      if (series.x.empty() && small.x.empty()) continue;
      table.add_row({maps[m].device, maps[m].compensated ? "compensated" : "taken as rigid",
                     std::string(to_text(of_class)), std::to_string(series.x.size()),
                     std::to_string(small.x.size())});
      if (series.x.empty()) small.label = series.label;
      if (!series.x.empty()) plot.series.push_back(series);
      if (!small.x.empty()) plot.series.push_back(small);
    }
    const std::vector<double> dense = log_grid(0.05, 1000.0, 60);
    plot.series.push_back(line_over(dense, "softest feasible (3.8)", 7, false, feasible));
    plot.series.push_back(line_over(dense, "the object's own", 7, true, [](double k) { return k; }));
    context.report.add_plot("stability_classes_" + maps[m].device + (maps[m].compensated ? "" : "_rigid"),
                            plot);
  }
  context.report.add_table(
      "stability_classes", "Class maps: how many cells fall into each class", table,
      "Small squares, right of the solid line: the device is at its limit under 4 N (3.8): it gives all it "
      "has, steadily, "
      "and the object feels stiffer than was asked: stable, but not what was asked. Classes, of the 1.85 s "
      "after a knock: guard latched; contact lost (the tip was off the object in more than 2 % of the last "
      "second); undetected (on it, but taken for free as often); limit cycle (tip or force swings about the "
      "straight line of a quarter second by more than 0.1 mm or 1 N, and no less than half of what it did a "
      "second before); diverging (more than twice that); slow mode (stable, still creeping by 0.1 mm a "
      "second); stable.");
}

}  // namespace

void run_stability_maps(StudyContext& context) {
  // Before the threads ask for them.
  for (const std::string& object : explored_objects()) {
    if (!context.quick || object == kExplored) identified(object);
  }
  run_granted(context);
  run_class_maps(context);
  run_boundaries(context);
}

}  // namespace hapticd::study
