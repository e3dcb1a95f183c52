#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "hal/sim/hand/hand_motion.h"
#include "rt/control/default_gains.h"
#include "rt/target/largest_target.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/stability/analytic_bound.h"
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
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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

/// One way to run the loop.
struct Variant {
  std::string name;
  std::function<StabilityTrial(const std::string& device, double object_n_per_mm)> trial;
  bool in_quick = false;
};

StabilityTrial scaled_tap(const std::string& device, double k, bool compensated, double rate_hz = 1000.0) {
  StabilityTrial trial = tap_trial(device, scaled_object(kTapped, k), rate_hz);
  trial.scene.structural_compensation = compensated;
  // What the simulated device takes to act is a tick of its loop, if that is faster than 1 kHz.
  trial.rig.custom_device->command_latency_s = std::min(1e-3, 1.0 / rate_hz);
  return trial;
}

StabilityTrial scaled_explore(const std::string& device, double k, bool passivity, bool compensated) {
  StabilityTrial trial = explore_trial(device, scaled_object(kExplored, k),
                                       scaled_model(identified(kExplored).model, kExplored, k));
  trial.scene.explore.passivity = passivity;
  trial.scene.structural_compensation = compensated;
  return trial;
}

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = [] {
    std::vector<Variant> list;
    for (const bool compensated : {true, false}) {
      const std::string base = compensated ? "tap_1d" : "tap_1d, taken as rigid";
      const auto with = [compensated](auto change) {
        return [compensated, change](const std::string& device, double k) {
          StabilityTrial trial = scaled_tap(device, k, compensated);
          change(trial);
          return trial;
        };
      };
      const auto at = [compensated](double rate_hz) {
        return [compensated, rate_hz](const std::string& device, double k) {
          return scaled_tap(device, k, compensated, rate_hz);
        };
      };
      list.push_back({base, at(1000.0), true});
      if (!compensated) list.push_back({base + ", 0.5 kHz", at(500.0)});
      list.push_back({base + ", 2 kHz", at(2000.0)});
      list.push_back({base + ", 5 kHz", at(5000.0), !compensated});
      list.push_back({base + ", 5 kHz, latency 1 ms", [compensated](const std::string& device, double k) {
                        StabilityTrial trial = scaled_tap(device, k, compensated, 5000.0);
                        trial.rig.custom_device->command_latency_s = 1e-3;
                        return trial;
                      }});
      list.push_back({base + ", open loop", with([](StabilityTrial& trial) {
                        trial.scene.controller.law = rt::ControlLaw::kOpenLoop;
                      })});
      list.push_back({base + ", the other device's gains", with([](StabilityTrial& trial) {
                        const bool small = trial.rig.device == "phantom_1_0";
                        trial.scene.controller =
                            rt::default_gains(small ? "phantom_1_5_high_force" : "phantom_1_0");
                      })});
      list.push_back({base + ", 408 g weight", with([](StabilityTrial& trial) { trial.weight = true; })});
    }
    for (const bool compensated : {true, false}) {
      for (const bool passivity : {true, false}) {
        list.push_back({std::string("explore_bearing") + (passivity ? "" : ", no passivity control") +
                            (compensated ? "" : ", taken as rigid"),
                        [passivity, compensated](const std::string& device, double k) {
                          return scaled_explore(device, k, passivity, compensated);
                        },
                        compensated});
      }
    }
    return list;
  }();
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

double bound_of(const StabilityTrial& trial) {
  const sim::DeviceModel& device = trial.device();
  rt::ControllerParameters gains = trial.scene.controller;
  if (gains.proportional_gain == 0.0) {
    gains.proportional_gain = rt::default_gains(device.name).proportional_gain;
  }
  const double kp = gains.law == rt::ControlLaw::kOpenLoop ? 1.0 : gains.proportional_gain;
  const double hand = trial.weight ? 0.0 : sim::impedance_of({}).damping_n_s_per_mm;
  return analytic_bound_n_per_mm(
      loop_delays(trial.rig.rate_hz, kp, device.amplifier_pole_hz, device.command_latency_s),
      trial.object_n_per_mm(), hand + device.viscous_friction_n_s_per_mm);
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
  std::size_t unstable_in_all = 0;
  std::size_t tried_in_all = 0;
  std::size_t saturated_in_all = 0;
  std::size_t held_in_all = 0;
  std::size_t too_stiff_for_hand = 0;
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
      const bool soft = grid[j] < granted.trial.object_n_per_mm();
      const bool saturated = soft && verdicts[j] == StabilityClass::kGuardLatched;
      if (saturated) ++saturated_in_all;
      if (!saturated && !is_stable(verdicts[j]) && !granted.trial.weight) ++too_stiff_for_hand;
    }
    unstable_in_all += unstable;
    held_in_all += held;
    tried_in_all += grid.size();
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
          "device may press the tool in. ") +
          kTrialInWords);
  context.report.say(
      std::to_string(unstable_in_all) + " of " + std::to_string(tried_in_all) +
      " feasible and granted targets on the presets are not stable in the simulation. " +
      std::to_string(saturated_in_all) +
      " of them are softer than the object and end with the guard's latch. The others: " +
      std::to_string(too_stiff_for_hand) + " under a hand, " +
      std::to_string(unstable_in_all - saturated_in_all - too_stiff_for_hand) +
      " under the bare weight, which bounces when it is let down and has no hand's damping. " +
      std::to_string(held_in_all) +
      " of those that are stable ask for a softer object than device and sensor can make of one that "
      "densifies, which (3.8) with one stiffness does not know: the device gives steadily all it may "
      "(rt/target/device_reach.h), and the object feels stiffer than was asked.");
}

// ---------------------------------------------------------------- boundaries

struct Boundaries {
  std::vector<double> objects;
  std::vector<const Variant*> variants;
  std::vector<report::CellValues> values;

  const report::CellValues& of(std::size_t device, std::size_t variant, std::size_t object) const {
    return values[(device * variants.size() + variant) * objects.size() + object];
  }
};

void add_margins(StudyContext& context, const Boundaries& found) {
  struct Named {
    const char* name;
    double target;
  };
  double narrowest = HUGE_VAL;
  std::string where;
  for (std::size_t d = 0; d < devices().size(); ++d) {
    for (std::size_t v = 0; v < found.variants.size(); ++v) {
      for (std::size_t o = 0; o < found.objects.size(); ++o) {
        const double k = found.objects[o];
        const StabilityTrial trial = found.variants[v]->trial(devices()[d], k);
        const double granted = granted_n_per_mm(trial);
        const double softest = softest_feasible_n_per_mm(trial);
        const std::array<Named, 3> targets{
            {{"half the object's", 0.5 * k}, {"the object's own", k}, {"stiffest granted", granted}}};
        for (const Named& target : targets) {
          report::Figure figure{"stability_margin",
                                {{"device", devices()[d]},
                                 {"object_stiffness", std::stod(significant(k, 3))},
                                 {"target", target.name},
                                 {"options", found.variants[v]->name}}};
          figure.goal = 1.0;
          figure.source =
              "factor from the target to the nearer end of the stable range, or to the end of the search; "
              "below 1 "
              "it is unstable itself";
          const report::CellValues& values = found.of(d, v, o);
          if (values.empty() || target.target < softest) {
            figure.failed = "not feasible under 4 N (3.8)";
          } else if (target.target > 1.001 * granted) {
            figure.failed = "not granted";
          } else if (const StableRange range = range_of(values); !range.any()) {
            figure.failed = "no stable target: " + std::string(to_text(range.at_start));
          } else {
            figure.value = range.margin(target.target);
            const bool as_shipped =
                found.variants[v]->name == "tap_1d" || found.variants[v]->name == "explore_bearing";
            if (as_shipped && *figure.value < narrowest) {
              narrowest = *figure.value;
              where = devices()[d] + ", " + found.variants[v]->name + ", object of " + significant(k, 2) +
                      " N/mm, target " + significant(target.target, 3) + " N/mm";
            }
          }
          context.report.add(figure);
        }
      }
    }
  }
  context.report.say("Narrowest margin of what is granted as shipped: " + significant(narrowest, 2) + " (" +
                     where + "); a margin below 1 means that the target itself is unstable.");
}

void add_boundary_table(StudyContext& context, const Boundaries& found) {
  std::vector<std::string> headers{"device", "loop"};
  std::vector<std::size_t> columns;
  for (std::size_t o = 0; o < found.objects.size(); o += context.quick ? 1 : 2) {
    columns.push_back(o);
    headers.push_back("k = " + significant(found.objects[o], 2));
  }
  report::MarkdownTable table(headers);
  for (std::size_t d = 0; d < devices().size(); ++d) {
    for (std::size_t v = 0; v < found.variants.size(); ++v) {
      std::vector<std::string> row{devices()[d], found.variants[v]->name};
      for (const std::size_t o : columns) {
        const report::CellValues& values = found.of(d, v, o);
        row.push_back(values.empty() ? report::kNoNumber : shown(range_of(values)));
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
          "presets' sponge and wood). Latency: a tick, at most 1 ms, unless said. " +
          kTrialInWords);
}

/// Curves of some variants; in a gap of the line no target is stable, or none is feasible.
std::vector<report::PlotSeries> curves(const Boundaries& found, std::size_t device,
                                       const std::vector<std::pair<std::string, std::string>>& wanted) {
  std::vector<report::PlotSeries> all;
  int colour = 0;
  for (const auto& [name, label] : wanted) {
    for (std::size_t v = 0; v < found.variants.size(); ++v) {
      if (found.variants[v]->name != name) continue;
      report::PlotSeries series{.name = label,
                                .color = cli::palette(static_cast<std::size_t>(colour)),
                                .mark = report::PlotMark::kOfColor};
      for (std::size_t o = 0; o < found.objects.size(); ++o) {
        const report::CellValues& values = found.of(device, v, o);
        const bool any = !values.empty() && range_of(values).any();
        series.add(found.objects[o], any ? range_of(values).max_n_per_mm : kNan);
      }
      all.push_back(series);
    }
    ++colour;
  }
  return all;
}

void set_axes(report::Plot& plot, double lowest, double highest) {
  plot.x = {"object stiffness", "N/mm", true, 0.04, 1250.0};
  plot.y = {"target stiffness", "N/mm", true, lowest, highest};
}

report::PlotSeries line_over(const std::vector<double>& objects, const std::string& label, int colour,
                             bool dashed, const std::function<double(double)>& value) {
  report::PlotSeries series{label, cli::palette(static_cast<std::size_t>(colour)),
                            dashed ? report::PlotLine::kDashed : report::PlotLine::kSolid};
  for (const double k : objects) series.add(k, value(k));
  return series;
}

/// The dissertation's 1D ranges, as far as its text gives them (D§3.3.2, D§4.6.2), over its objects.
report::PlotSeries dissertation_range(const std::string& device) {
  const std::vector<double> objects{0.38, 0.45, 0.59, 2.26};
  if (device == "phantom_1_0") {
    return line_over(objects, "D§3.3.2: above k + 1", 7, true, [](double k) { return k + 1.0; });
  }
  return line_over(objects, "D§4.6.2 on 1D: about 10", 7, true, [](double) { return 10.0; });
}

void plot_boundaries(StudyContext& context, const Boundaries& found) {
  for (std::size_t d = 0; d < devices().size(); ++d) {
    const std::string& device = devices()[d];
    const auto trial_at = [&](double k, double rate_hz) { return scaled_tap(device, k, false, rate_hz); };
    report::Plot rates;
    rates.title = "Largest stable target by loop rate, device taken as rigid, " + device;
    set_axes(rates, 0.3, 100.0);
    rates.series = curves(found, d,
                          {{"tap_1d, taken as rigid, 0.5 kHz", "0.5 kHz"},
                           {"tap_1d, taken as rigid", "1 kHz"},
                           {"tap_1d, taken as rigid, 2 kHz", "2 kHz"},
                           {"tap_1d, taken as rigid, 5 kHz", "5 kHz"},
                           {"tap_1d, taken as rigid, 5 kHz, latency 1 ms", "5 kHz, latency 1 ms"}});
    const std::vector<double> dense = log_grid(0.05, 1000.0, 60);
    for (const auto& [rate_hz, colour] : {std::pair{500.0, 0}, {1000.0, 1}, {2000.0, 2}, {5000.0, 3}}) {
      rates.series.push_back(line_over(dense, colour == 1 ? "(b + τf k)/τx, dashed" : "", colour, true,
                                       [&](double k) { return bound_of(trial_at(k, rate_hz)); }));
    }
    rates.series.push_back(line_over(dense, "softest feasible (3.8)", 7, false, [&](double k) {
      return softest_feasible_n_per_mm(trial_at(k, 1000.0));
    }));
    rates.series.push_back(dissertation_range(device));
    context.report.add_plot("stability_rates_" + device, rates);

    report::Plot options;
    options.title = "Largest stable target by scene and options, 1 kHz, " + device;
    set_axes(options, 0.3, 100.0);
    options.series = curves(found, d,
                            {{"tap_1d", "tap_1d as shipped"},
                             {"tap_1d, taken as rigid", "… taken as rigid"},
                             {"tap_1d, taken as rigid, open loop", "… rigid, open loop"},
                             {"tap_1d, taken as rigid, 408 g weight", "… rigid, 408 g weight"},
                             {"explore_bearing", "explore_bearing as shipped"},
                             {"explore_bearing, no passivity control", "… no passivity control"},
                             {"explore_bearing, taken as rigid", "… taken as rigid"}});
    options.series.push_back(line_over(dense, "softest feasible (3.8)", 7, false, [&](double k) {
      return softest_feasible_n_per_mm(trial_at(k, 1000.0));
    }));
    options.series.push_back(line_over(dense, "granted as shipped", 7, true, [&](double k) {
      return granted_n_per_mm(scaled_tap(device, k, true));
    }));
    context.report.add_plot("stability_options_" + device, options);
  }
}

const Variant* named(const Boundaries& found, const std::string& name, std::size_t& index) {
  for (index = 0; index < found.variants.size(); ++index) {
    if (found.variants[index]->name == name) return found.variants[index];
  }
  return nullptr;
}

/// What the boundaries say, in numbers.
void say_boundaries(StudyContext& context, const Boundaries& found) {
  for (std::size_t d = 0; d < devices().size(); ++d) {
    std::size_t rigid = 0;
    std::size_t shipped = 0;
    std::size_t guarded = 0;
    std::size_t bare = 0;
    const Variant* rigid_variant = named(found, "tap_1d, taken as rigid", rigid);
    const bool all = rigid_variant != nullptr && named(found, "tap_1d", shipped) != nullptr &&
                     named(found, "explore_bearing", guarded) != nullptr &&
                     named(found, "explore_bearing, no passivity control", bare) != nullptr;
    if (!all) continue;
    double stiffest = 0.0;
    double least = HUGE_VAL;
    double most = 0.0;
    double lowest_share = HUGE_VAL;
    double passivity_least = HUGE_VAL;
    double passivity_most = 0.0;
    for (std::size_t o = 0; o < found.objects.size(); ++o) {
      const auto range = [&](std::size_t v) {
        const report::CellValues& values = found.of(d, v, o);
        return values.empty() ? StableRange{} : range_of(values);
      };
      const StabilityTrial trial = rigid_variant->trial(devices()[d], found.objects[o]);
      if (const StableRange r = range(rigid); r.any()) {
        stiffest = found.objects[o];
        least = std::min(least, r.max_n_per_mm / bound_of(trial));
        most = std::max(most, r.max_n_per_mm / bound_of(trial));
      }
      if (const StableRange r = range(shipped); r.any()) {
        lowest_share = std::min(lowest_share, r.max_n_per_mm / trial.device().structural_stiffness_n_per_mm);
      }
      if (const StableRange with = range(guarded), without = range(bare); with.any() && without.any()) {
        passivity_least = std::min(passivity_least, with.max_n_per_mm / without.max_n_per_mm);
        passivity_most = std::max(passivity_most, with.max_n_per_mm / without.max_n_per_mm);
      }
    }
    context.report.say(
        devices()[d] + ": as shipped, tap_1d is stable up to " + fixed(lowest_share, 2) +
        " of the structural stiffness on every object tried; it grants " +
        fixed(rt::kMaxTargetNPerMm / sim::device_preset(devices()[d])->structural_stiffness_n_per_mm, 2) +
        ". Taken as rigid, the stiffest "
        "object with a stable feasible target has " +
        significant(stiffest, 2) + " N/mm at 1 kHz, and the boundary is " + fixed(least, 2) + " to " +
        fixed(most, 2) +
        " times the analytic bound: above it on soft objects, whose structure and friction help, below it on "
        "stiff ones, where the structure that it leaves out bends more than the object. Passivity control "
        "moves the boundary of explore_bearing by a factor of " +
        fixed(passivity_least, 2) + " to " + fixed(passivity_most, 2) + ".");
  }
}

void run_boundaries(StudyContext& context) {
  Boundaries found;
  found.objects = object_stiffnesses(context.quick);
  for (const Variant& variant : variants()) {
    if (!context.quick || variant.in_quick) found.variants.push_back(&variant);
  }
  const std::size_t objects = found.objects.size();
  const std::size_t of_device = found.variants.size() * objects;
  auto values =
      context.cells.values("stability_boundaries", devices().size() * of_device, [&](std::size_t cell) {
        const Variant& variant = *found.variants[cell % of_device / objects];
        return boundary_cell(variant.trial(devices()[cell / of_device], found.objects[cell % objects]),
                             context.quick ? 1.0 / 4.0 : 1.0 / 16.0);
      });
  if (!values) return;
  found.values = std::move(*values);
  add_boundary_table(context, found);
  say_boundaries(context, found);
  plot_boundaries(context, found);
  add_margins(context, found);
}

// ---------------------------------------------------------------- class maps

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
  constexpr std::array<std::size_t, kStabilityClasses> kColours{2, 4, 5, 1, 3, 6, 7};
  report::MarkdownTable table({"device", "structure", "class", "feasible cells", "infeasible cells"});
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const std::vector<double> grid = grid_of(maps[m]);
    report::Plot plot;
    plot.title = maps[m].device + ", tap_1d " + (maps[m].compensated ? "as shipped" : "taken as rigid") +
                 ": class of every target";
    set_axes(plot, 0.04, 1.3 * grid.back());
    const auto feasible = [&](double k) {
      return softest_feasible_n_per_mm(scaled_tap(maps[m].device, k, maps[m].compensated));
    };
    for (std::size_t c = 0; c < kStabilityClasses; ++c) {
      const auto of_class = static_cast<StabilityClass>(c);
      report::PlotSeries series = report::dots(std::string(to_text(of_class)), cli::palette(kColours[c]));
      series.mark = report::PlotMark::kSquare;
      series.mark_size = 1.3;
      report::PlotSeries small = series;
      small.name.clear();
      small.mark_size = 0.5;
      for (std::size_t o = 0; o < objects.size(); ++o) {
        for (std::size_t t = 0; t < targets; ++t) {
          if (static_cast<std::size_t>((*cells)[m * of_map + o * targets + t].at(0)) != c) continue;
          report::PlotSeries& of = grid[t] < feasible(objects[o]) ? small : series;
          of.add(objects[o], grid[t]);
        }
      }
      if (series.points.empty() && small.points.empty()) continue;
      table.add_row({maps[m].device, maps[m].compensated ? "compensated" : "taken as rigid",
                     std::string(to_text(of_class)), std::to_string(series.points.size()),
                     std::to_string(small.points.size())});
      if (series.points.empty()) small.name = series.name;
      if (!series.points.empty()) plot.series.push_back(series);
      if (!small.points.empty()) plot.series.push_back(small);
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
