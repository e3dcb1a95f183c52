#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/trust/trust_study.h"
#include "tests/measure/study/trust/trust_trial.h"
#include "tests/support/free_air_judge.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::FreeAirJudge;

constexpr const char* kSource = "the property: at most 0.3 N, below 0.05 N within 20 ms";

/// Every cell of the sweep, in an order that does not change. Where nothing is ever touched it is all one
/// what law an object would follow: such causes run on the separable family only.
std::vector<TrustCase> cases_of(bool quick) {
  const bool with_objects_only = current_plant() != sim::Plant::kSeparable;
  std::vector<TrustCase> all;
  for (const TrustCause& cause : trust_causes()) {
    if ((quick && !cause.in_test) || (with_objects_only && !cause.needs_object)) continue;
    for (const std::string& scene : trust_scenes()) {
      // A wall has no object; and what the sensor does is nothing to it.
      if (scene == "wall" && cause.needs_object) continue;
      for (const std::string& device : trust_devices()) {
        if (quick && scene == "wall" && device != "phantom_1_0") continue;
        for (const double rate_hz : {1000.0, 5000.0}) {
          if (quick && rate_hz != 1000.0) continue;
          const std::uint64_t seeds = quick || rate_hz > 1000.0 ? 1 : 2;
          for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            TrustCase trial;
            trial.cause = &cause;
            trial.scene = scene;
            trial.device = device;
            trial.rate_hz = rate_hz;
            trial.seed = seed;
            all.push_back(trial);
          }
        }
        if (scene == "wall" || (quick && device != "phantom_1_0")) continue;
        TrustCase published;
        published.cause = &cause;
        published.scene = scene;
        published.device = device;
        published.published = true;
        all.push_back(published);
      }
    }
  }
  return all;
}

report::CellValues values_of(const TrustOutcome& o) {
  return {o.simulated_s, o.free_s,    o.max_n,  o.max_at_s,     o.longest_ms,       o.longest_at_s,
          o.declared,    o.withdrawn, o.zero_n, o.silent_share, o.holds ? 1.0 : 0.0};
}
TrustOutcome outcome_of(const report::CellValues& v) {
  TrustOutcome o;
  o.simulated_s = v[0];
  o.free_s = v[1];
  o.max_n = v[2];
  o.max_at_s = v[3];
  o.longest_ms = v[4];
  o.longest_at_s = v[5];
  o.declared = v[6];
  o.withdrawn = v[7];
  o.zero_n = v[8];
  o.silent_share = v[9];
  o.holds = v[10] > 0.5;
  return o;
}

/// What is kept of several runs: the worst of each.
struct Worst {
  TrustOutcome of;
  const TrustCase* hardest = nullptr;  ///< most force; where that is the same, longest
  int runs = 0;
  int failing = 0;
  double seconds = 0.0;

  void add(const TrustCase& trial, const TrustOutcome& o) {
    const bool harder =
        hardest == nullptr || o.max_n > of.max_n || (o.max_n == of.max_n && o.longest_ms > of.longest_ms);
    if (harder) {
      hardest = &trial;
      of.max_at_s = o.max_at_s;
    }
    if (o.longest_ms > of.longest_ms) of.longest_at_s = o.longest_at_s;
    of.max_n = std::max(of.max_n, o.max_n);
    of.longest_ms = std::max(of.longest_ms, o.longest_ms);
    of.declared += o.declared;
    of.withdrawn += o.withdrawn;
    of.zero_n = std::max(of.zero_n, o.zero_n);
    of.silent_share = std::max(of.silent_share, o.silent_share);
    failing += o.holds ? 0 : 1;
    seconds += o.simulated_s;
    ++runs;
  }
};

/// Names of causes in their order, each once.
std::vector<std::string> names_in_order() {
  std::vector<std::string> names;
  for (const TrustCause& cause : trust_causes()) {
    if (names.empty() || names.back() != cause.name) names.push_back(cause.name);
  }
  return names;
}

void add_figures(StudyContext& context, const std::vector<TrustCase>& cases,
                 const std::vector<TrustOutcome>& outcomes) {
  // One record for cause, scene, device and rate: the worst level and seed.
  std::map<std::string, std::pair<const TrustCase*, Worst>> by_case;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const TrustCase& t = cases[i];
    const std::string key =
        t.cause->name + t.scene + t.device + fixed(t.rate_hz, 0) + (t.published ? "p" : "");
    auto [at, is_new] = by_case.try_emplace(key, &t, Worst{});
    if (is_new) order.push_back(key);
    at->second.second.add(t, outcomes[i]);
  }
  for (const std::string& key : order) {
    const TrustCase& t = *by_case[key].first;
    const Worst& worst = by_case[key].second;
    report::Case conditions{
        {"cause", t.cause->name}, {"scene", t.scene}, {"device", t.device}, {"rate_hz", t.rate_hz}};
    if (t.published) conditions.emplace_back("pipeline", "published");
    report::Figure force{"free_air_force_max_n", conditions};
    force.unit = "N";
    force.value = worst.of.max_n;
    force.goal = FreeAirJudge::kMaxN;
    force.source = kSource;
    context.report.add(force);
    report::Figure duration{"free_air_force_duration_ms", conditions};
    duration.unit = "ms";
    duration.value = worst.of.longest_ms;
    duration.goal = 1e3 * FreeAirJudge::kWithinS;
    duration.source = kSource;
    context.report.add(duration);
    if (t.cause->name != "object_vanishes") continue;
    report::Figure vanish{"vanish_to_zero_ms",
                          {{"scene", t.scene}, {"device", t.device}, {"rate_hz", t.rate_hz}}};
    if (t.published) vanish.conditions.emplace_back("pipeline", "published");
    vanish.unit = "ms";
    vanish.value = worst.of.longest_ms;
    vanish.goal = 1e3 * FreeAirJudge::kWithinS;
    vanish.source = "from the end of the contact to less than 0.05 N";
    context.report.add(vanish);
  }
}

std::string share_of(int part, int whole) {
  return std::to_string(part) + " of " + std::to_string(whole);
}

/// The tick-by-tick story of the worst run of a cause.
report::PlotSeries story(const std::string& label, const TrustCase& trial, double at_s,
                         const TrustModels& models, std::optional<int> colour, bool dashed) {
  std::vector<TrustTick> ticks;
  run_trust_case(trial, models, &ticks, at_s - 0.1, at_s + 0.2);
  report::PlotSeries series{label};
  series.colour = colour;
  series.dashed = dashed;
  for (const TrustTick& tick : ticks) series.add(1e3 * (tick.time_s - at_s), tick.force_n);
  return series;
}

}  // namespace

void run_free_air(StudyContext& context) {
  const std::vector<TrustCase> cases = cases_of(context.quick);
  const IdentificationResult& foam = identified("foam_ball_3d");  // once, before there are threads
  const TrustModels models{&foam.model, &foam.dissertation};
  const auto cells = context.cells.values("trust_free_air", cases.size(), [&](std::size_t cell) {
    return values_of(run_trust_case(cases[cell], models));
  });
  if (!cells) return;
  std::vector<TrustOutcome> outcomes;
  for (const auto& cell : *cells) outcomes.push_back(outcome_of(cell));
  add_figures(context, cases, outcomes);

  std::map<std::string, Worst> ours, published, ours_by_level;
  double seconds = 0.0;
  double free_seconds = 0.0;
  int runs = 0;
  int failing = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const TrustCase& t = cases[i];
    (t.published ? published : ours)[t.cause->name].add(t, outcomes[i]);
    if (t.published) continue;
    ours_by_level[t.cause->label()].add(t, outcomes[i]);
    seconds += outcomes[i].simulated_s;
    free_seconds += outcomes[i].free_s;
    ++runs;
    failing += outcomes[i].holds ? 0 : 1;
  }
  const auto total = [&](const char* name, double value, const char* unit, std::optional<double> goal) {
    report::Figure figure{name};
    figure.value = value;
    figure.unit = unit;
    figure.goal = goal;
    figure.source = kSource;
    context.report.add(figure);
  };
  total("trust_simulated_s", seconds, "s", std::nullopt);
  total("trust_failing_share", runs > 0 ? static_cast<double>(failing) / runs : 0.0, "1", 0.0);

  report::MarkdownTable table({"cause", "runs", "failing", "largest N", "longest ms", "contacts declared",
                               "withdrawn", "zero followed mN", "guard without force", "published: failing",
                               "largest N", "longest ms"});
  report::SvgPlot bars;
  bars.title = "Largest force in free air, from 20 ms after a contact";
  bars.x = {"force asked of the device", "N", true, 1e-4, 100.0};
  bars.height_px = 700;
  bars.references = {{report::PlotReference::Axis::kX, FreeAirJudge::kMaxN, "0.3 N"},
                     {report::PlotReference::Axis::kX, FreeAirJudge::kZeroN, "0.05 N"}};
  report::PlotSeries our_dots{"ours", {}, {}, report::PlotSeries::Style::kPoints, 0};
  report::PlotSeries their_dots{"published", {}, {}, report::PlotSeries::Style::kPoints, 1};
  our_dots.point_size = their_dots.point_size = 1.0;
  for (const std::string& name : names_in_order()) {
    if (ours.count(name) == 0) continue;
    const Worst& w = ours[name];
    const Worst& p = published[name];
    table.add_row({name, std::to_string(w.runs), std::to_string(w.failing), fixed(w.of.max_n, 3),
                   fixed(w.of.longest_ms, 1), fixed(w.of.declared, 0), fixed(w.of.withdrawn, 0),
                   fixed(1e3 * w.of.zero_n, 1), fixed(100.0 * w.of.silent_share, 1) + " %",
                   share_of(p.failing, p.runs), fixed(p.of.max_n, 3), fixed(p.of.longest_ms, 1)});
    const auto line = static_cast<double>(bars.y.categories.size());
    std::string label = name;
    std::replace(label.begin(), label.end(), '_', ' ');
    bars.y.categories.push_back(label);
    constexpr double kFloorN = 1.2e-4;  // zero has no place on a logarithmic axis
    our_dots.add(std::max(kFloorN, w.of.max_n), line - 0.12);
    their_dots.add(std::max(kFloorN, p.of.max_n), line + 0.12);

    report::Figure zero{"zero_tracked_n", {{"cause", name}}};
    zero.unit = "N";
    zero.value = w.of.zero_n;
    context.report.add(zero);
    report::Figure withdrawn{"contact_withdrawn", {{"cause", name}}};
    withdrawn.value = w.of.withdrawn;
    withdrawn.source = "in all runs of the cause";
    context.report.add(withdrawn);
  }
  bars.series = {our_dots, their_dots};
  context.report.add_table(
      "trust_free_air", "Force where nothing is touched", table,
      fixed(seconds, 0) + " simulated seconds, " + fixed(free_seconds, 0) +
          " of them in free air by the truth; tap_1d, explore_rod, explore_bearing and wall (away from its "
          "plane), both devices, 1 and 5 kHz, several seeds; 12.6 g tool, targets 0.7 and 0.8 N/mm. The tool "
          "rests and is waved ±20 mm at 2.2 Hz in all directions, or (abrupt hand, lab) moved with 400 mm/s "
          "and 20 m/s²; where an object is lost it is pressed or stroked before. A latched guard is cleared "
          "after 0.3 s. Contacts declared: where nothing was touched.");
  context.report.add_plot("trust_free_air", bars);

  report::MarkdownTable levels({"cause", "runs", "failing", "largest N", "longest ms", "worst run"});
  for (const TrustCause& cause : trust_causes()) {
    const auto at = ours_by_level.find(cause.label());
    if (at == ours_by_level.end()) continue;
    const Worst& w = at->second;
    levels.add_row({cause.label(), std::to_string(w.runs), std::to_string(w.failing), fixed(w.of.max_n, 3),
                    fixed(w.of.longest_ms, 1), w.hardest->text() + ", at " + fixed(w.of.max_at_s, 3) + " s"});
  }
  context.report.add_table("trust_levels", "The same by level, with the worst run", levels);

  // The worst runs, reported tick by tick.
  report::SvgPlot traces;
  traces.title = "Worst runs: causes with more than 0.05 N, and the published pipeline";
  traces.x = {"time around the largest force", "ms", false, -100.0, 200.0};
  traces.y = {"force asked of the device", "N"};
  traces.y.minimum = 0.0;
  traces.height_px = 620;
  traces.references = {{report::PlotReference::Axis::kY, FreeAirJudge::kMaxN, "0.3 N"}};
  int colour = 0;
  const Worst* worst_published = nullptr;
  for (const std::string& name : names_in_order()) {
    if (published.count(name) > 0 &&
        (worst_published == nullptr || published[name].of.max_n > worst_published->of.max_n)) {
      worst_published = &published[name];
    }
    const auto at = ours.find(name);
    constexpr int kMaxTraces = 10;
    if (at == ours.end() || at->second.of.max_n < FreeAirJudge::kZeroN || colour >= kMaxTraces) continue;
    traces.series.push_back(story(at->second.hardest->cause->label(), *at->second.hardest,
                                  at->second.of.max_at_s, models, colour, false));
    ++colour;
  }
  if (worst_published != nullptr && worst_published->hardest != nullptr && worst_published->of.max_n > 0.0) {
    traces.series.push_back(story("published: " + worst_published->hardest->cause->label(),
                                  *worst_published->hardest, worst_published->of.max_at_s, models, colour,
                                  true));
  }
  if (!traces.series.empty()) context.report.add_plot("trust_worst", traces);
}

}  // namespace hapticd::study
