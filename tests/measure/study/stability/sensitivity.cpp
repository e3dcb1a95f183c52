#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/stability/scaled_object.h"
#include "tests/measure/study/stability/stability_trial.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr std::array<double, 2> kObjects{0.5, 5.0};
constexpr double kOctaves = 1.0 / 64.0;  // ratios to 1.1 %
constexpr double kQuickOctaves = 1.0 / 4.0;
constexpr double kEnd = 80.0;

/// One uncertain parameter, at the lower and at the upper end of what it might be.
struct Parameter {
  const char* name;  ///< of the figure
  const char* shown;
  std::array<double, 2> values;
  void (*set)(StabilityTrial& trial, double value);
  bool in_quick = false;
};

const std::vector<Parameter>& parameters() {
  static const std::vector<Parameter> all{
      {"command_latency_ms",
       "latency 0.5 … 1.5 ms",
       {0.5, 1.5},
       [](StabilityTrial& t, double value) { t.rig.custom_device->command_latency_s = 1e-3 * value; },
       true},
      {"amplifier_pole_hz",
       "amplifier pole 100 … 1400 Hz",
       {100.0, 1400.0},
       [](StabilityTrial& t, double value) { t.rig.custom_device->amplifier_pole_hz = value; }},
      {"structural_mode_hz",
       "structural mode 70 … 220 Hz",
       {70.0, 220.0},
       [](StabilityTrial& t, double value) { t.rig.custom_device->structural_mode_hz = value; }},
      {"structural_damping",
       "mode's damping 0.01 … 0.15",
       {0.01, 0.15},
       [](StabilityTrial& t, double value) { t.rig.custom_device->structural_damping = value; }},
      {"hand_damping_n_s_per_m",
       "hand's damping 2 … 6 N·s/m",
       {2.0, 6.0},
       [](StabilityTrial& t, double value) { t.grip_damping_scale = value / 4.0; },
       true},
      {"hand_stiffness_n_per_mm",
       "hand's stiffness 0.3 … 0.8 N/mm",
       {0.3, 0.8},
       [](StabilityTrial& t, double value) { t.grip_stiffness_scale = value / 0.5; }},
      {"coulomb_friction",
       "dry friction ×0 … ×2",
       {0.0, 2.0},
       [](StabilityTrial& t, double value) { t.rig.custom_device->coulomb_friction_n *= value; }},
      {"viscous_friction",
       "viscous friction ×0 … ×10",
       {0.0, 10.0},
       [](StabilityTrial& t, double value) { t.rig.custom_device->viscous_friction_n_s_per_mm *= value; }},
      {"encoder_resolution",
       "encoder step ×0.1 … ×3",
       {0.1, 3.0},
       [](StabilityTrial& t, double value) { t.rig.custom_device->encoder_resolution_mm *= value; }},
      {"knock_n", "knock 0.3 … 3 N", {0.3, 3.0}, [](StabilityTrial& t, double value) { t.knock_n = value; }},
      {"object_viscosity", "object's viscosity ×0.3 … ×3", {0.3, 3.0}, [](StabilityTrial& t, double value) {
         t.rig.custom_object->material.skin_viscosity_n_s_per_mm *= value;
       }}};
  return all;
}

struct Loop {
  std::string device;
  bool compensated = false;
  std::string name() const {
    return device + (compensated ? ", tap_1d as shipped" : ", tap_1d taken as rigid");
  }
};

/// Loops in which the shipped compensation leaves room for a boundary below what it grants, and without it.
const std::vector<Loop>& loops() {
  static const std::vector<Loop> all{
      {"phantom_1_0", true}, {"phantom_1_0", false}, {"phantom_1_5_high_force", false}};
  return all;
}

StableRange boundary(const Loop& loop, double k, const Parameter* parameter, double value, double octaves) {
  StabilityTrial trial = tap_trial(loop.device, scaled_object("rubber_eraser", k));
  trial.scene.structural_compensation = loop.compensated;
  if (parameter != nullptr) parameter->set(trial, value);
  const double end = std::min(kEnd, compensable_n_per_mm(trial));
  const double start = std::min(k, 0.5 * end);
  return find_stable_range(trial, std::min(start, softest_feasible_n_per_mm(trial)), start, end, octaves);
}

void plot_tornado(StudyContext& context, const Loop& loop, const std::string& name,
                  const std::vector<const Parameter*>& used,
                  const std::vector<std::array<double, 4>>& ratios) {
  constexpr double kOffsetToShowBoth = 0.14;
  report::Plot plot;
  plot.title = "What uncertain parameters do to the largest stable target, " + loop.name();
  plot.x = {"largest stable target over its nominal value", "1", false, 0.0, 4.4};
  for (const Parameter* parameter : used) plot.y.categories.emplace_back(parameter->shown);
  report::PlotSeries lower = report::dots("lower value", cli::palette(7));
  report::PlotSeries upper = lower;
  upper.name = "upper value";
  lower.mark = report::PlotMark::kOpenSquare;
  upper.mark = report::PlotMark::kSquare;
  lower.mark_size = upper.mark_size = 0.7;
  for (std::size_t o = 0; o < kObjects.size(); ++o) {
    report::PlotSeries bars{"object of " + significant(kObjects[o], 1) + " N/mm", cli::palette(o)};
    for (std::size_t p = 0; p < used.size(); ++p) {
      const double y = static_cast<double>(p) + (o == 0 ? kOffsetToShowBoth : -kOffsetToShowBoth);
      const double low = ratios[p][2 * o];
      const double high = ratios[p][2 * o + 1];
      bars.points.insert(bars.points.end(), {{low, y}, {high, y}, cli::kBreak});
      lower.add(low, y);
      upper.add(high, y);
    }
    plot.series.push_back(bars);
  }
  plot.series.push_back(lower);
  plot.series.push_back(upper);
  plot.references.push_back({report::PlotReference::Axis::kX, 1.0, ""});
  context.report.add_plot(name, plot);
}

}  // namespace

void run_stability_sensitivity(StudyContext& context) {
  std::vector<const Parameter*> used;
  for (const Parameter& parameter : parameters()) {
    if (!context.quick || parameter.in_quick) used.push_back(&parameter);
  }
  // Order for each loop and object: the nominal, then lower and upper value of each parameter.
  const std::size_t each = 1 + 2 * used.size();
  const std::size_t objects = context.quick ? 1 : kObjects.size();
  const std::size_t of_loop = objects * each;
  const double octaves = context.quick ? kQuickOctaves : kOctaves;
  const auto cells =
      context.cells.values("stability_sensitivity", loops().size() * of_loop, [&](std::size_t cell) {
        const Loop& loop = loops()[cell / of_loop];
        const double k = kObjects[cell % of_loop / each];
        const std::size_t i = cell % each;
        if (i == 0) return values_of(boundary(loop, k, nullptr, 0.0, octaves));
        const Parameter* parameter = used[(i - 1) / 2];
        return values_of(boundary(loop, k, parameter, parameter->values[(i - 1) % 2], octaves));
      });
  if (!cells) return;

  report::MarkdownTable table(
      {"loop", "parameter", "object N/mm", "nominal N/mm", "at the lower", "at the upper"});
  for (std::size_t l = 0; l < loops().size(); ++l) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    std::vector<std::array<double, 4>> ratios(used.size(), {kNone, kNone, kNone, kNone});
    double widest = 0.0;
    std::string widest_name;
    for (std::size_t p = 0; p < used.size(); ++p) {
      for (std::size_t o = 0; o < objects; ++o) {
        const std::size_t base = l * of_loop + o * each;
        const StableRange nominal = range_of((*cells)[base]);
        std::array<std::string, 2> shown;
        for (std::size_t side = 0; side < 2; ++side) {
          const StableRange range = range_of((*cells)[base + 1 + 2 * p + side]);
          report::Figure figure{"stability_boundary_ratio",
                                {{"device", loops()[l].device},
                                 {"compensated", loops()[l].compensated ? "yes" : "no"},
                                 {"object_stiffness", kObjects[o]},
                                 {"parameter", used[p]->name},
                                 {"value", used[p]->values[side]}}};
          figure.source = "largest stable target over the one at the nominal parameters";
          double ratio = std::numeric_limits<double>::quiet_NaN();
          if (!nominal.any() || !range.any()) {
            figure.failed = "no stable target: " +
                            std::string(to_text(nominal.any() ? range.at_start : nominal.at_start));
          } else {
            ratio = range.max_n_per_mm / nominal.max_n_per_mm;
            figure.value = ratio;
            if (std::abs(std::log(ratio)) > widest) {
              widest = std::abs(std::log(ratio));
              widest_name = used[p]->shown;
            }
          }
          context.report.add(figure);
          ratios[p][2 * o + side] = ratio;
          shown[side] = (range.any() && !range.max_found ? "≥ " : "") + fixed(ratio, 2);
        }
        table.add_row(
            {loops()[l].name(), used[p]->shown, significant(kObjects[o], 1),
             nominal.any() ? (nominal.max_found ? "" : "≥ ") + fixed(nominal.max_n_per_mm, 2) : "none",
             shown[0], shown[1]});
      }
    }
    plot_tornado(context, loops()[l],
                 "stability_sensitivity_" + loops()[l].device + (loops()[l].compensated ? "" : "_rigid"),
                 used, ratios);
    context.report.say(loops()[l].name() + ": most depends on " + widest_name +
                       ", which moves the boundary by a factor of " + fixed(std::exp(widest), 2) + ".");
  }
  context.report.add_table(
      "stability_sensitivity_report", "Largest stable target over its nominal value, one parameter at a time",
      table,
      std::string("Nominal: the presets at 1 kHz, default gains, object rubber_eraser scaled. Ends of a "
                  "parameter: the spread of published values where there is one (mode, hand), else assumed. "
                  "≥: stable to the end of the search. Boundaries are known to 1.1 % (quick: 19 %). ") +
          kTrialInWords);
}

}  // namespace hapticd::study
