#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
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
  return {o.simulated_s, o.free_s,    o.max_n,        o.max_at_s,         o.longest_ms,
          o.declared,    o.withdrawn, o.silent_share, o.holds ? 1.0 : 0.0};
}
TrustOutcome outcome_of(const report::CellValues& v) {
  TrustOutcome o;
  double* const fields[] = {&o.simulated_s, &o.free_s,   &o.max_n,     &o.max_at_s,
                            &o.longest_ms,  &o.declared, &o.withdrawn, &o.silent_share};
  for (std::size_t i = 0; i < std::size(fields); ++i) *fields[i] = v[i];
  o.holds = v[std::size(fields)] > 0.5;
  return o;
}

/// What is kept of several runs: the worst of each.
struct Worst {
  TrustOutcome of;
  const TrustCase* hardest = nullptr;  ///< most force; where that is the same, longest
  int runs = 0;
  int failing = 0;

  void add(const TrustCase& trial, const TrustOutcome& o) {
    const bool harder =
        hardest == nullptr || o.max_n > of.max_n || (o.max_n == of.max_n && o.longest_ms > of.longest_ms);
    if (harder) {
      hardest = &trial;
      of.max_at_s = o.max_at_s;
    }
    of.max_n = std::max(of.max_n, o.max_n);
    of.longest_ms = std::max(of.longest_ms, o.longest_ms);
    of.declared += o.declared;
    of.withdrawn += o.withdrawn;
    of.silent_share = std::max(of.silent_share, o.silent_share);
    failing += o.holds ? 0 : 1;
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
  const auto add = [&](const char* name, const char* unit, double value, double goal, const char* source,
                       report::Case conditions) {
    report::Figure figure{name, std::move(conditions)};
    figure.unit = unit;
    figure.value = value;
    figure.goal = goal;
    figure.source = source;
    context.report.add(figure);
  };
  constexpr double kGoalMs = 1e3 * FreeAirJudge::kWithinS;
  for (const std::string& key : order) {
    const TrustCase& t = *by_case[key].first;
    const TrustOutcome& worst = by_case[key].second.of;
    report::Case conditions{{"scene", t.scene}, {"device", t.device}, {"rate_hz", t.rate_hz}};
    if (t.published) conditions.emplace_back("pipeline", "published");
    if (t.cause->name == "object_vanishes")
      add("vanish_to_zero_ms", "ms", worst.longest_ms, kGoalMs,
          "from the end of the contact to less than 0.05 N", conditions);
    conditions.emplace(conditions.begin(), "cause", t.cause->name);
    add("free_air_force_max_n", "N", worst.max_n, FreeAirJudge::kMaxN, kSource, conditions);
    add("free_air_force_duration_ms", "ms", worst.longest_ms, kGoalMs, kSource, conditions);
  }
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

  std::map<std::string, Worst> ours, published;
  double free_seconds = 0.0;
  report::Figure simulated{"trust_simulated_s"};
  simulated.value = 0.0;
  simulated.unit = "s";
  simulated.source = kSource;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const TrustCase& t = cases[i];
    (t.published ? published : ours)[t.cause->name].add(t, outcomes[i]);
    if (t.published) continue;
    *simulated.value += outcomes[i].simulated_s;
    free_seconds += outcomes[i].free_s;
  }
  context.report.add(simulated);

  report::MarkdownTable table({"cause", "runs", "failing", "largest N", "longest ms", "contacts declared",
                               "withdrawn", "guard without force", "published: failing", "largest N",
                               "longest ms", "worst run"});
  report::Plot bars;
  bars.title = "Largest force in free air, from 20 ms after a contact";
  bars.x = {"force asked of the device", "N", true, 1e-4, 100.0};
  bars.references = {{report::PlotReference::Axis::kX, FreeAirJudge::kMaxN, "0.3 N"},
                     {report::PlotReference::Axis::kX, FreeAirJudge::kZeroN, "0.05 N"}};
  report::PlotSeries our_dots = report::dots("ours", cli::palette(0));
  report::PlotSeries their_dots = report::dots("published", cli::palette(1));
  our_dots.mark_size = their_dots.mark_size = 1.0;
  for (const std::string& name : names_in_order()) {
    if (ours.count(name) == 0) continue;
    const Worst& w = ours[name];
    const Worst& p = published[name];
    table.add_row({name, std::to_string(w.runs), std::to_string(w.failing), fixed(w.of.max_n, 3),
                   fixed(w.of.longest_ms, 1), fixed(w.of.declared, 0), fixed(w.of.withdrawn, 0),
                   fixed(100.0 * w.of.silent_share, 1) + " %",
                   std::to_string(p.failing) + " of " + std::to_string(p.runs), fixed(p.of.max_n, 3),
                   fixed(p.of.longest_ms, 1), w.hardest->text() + ", at " + fixed(w.of.max_at_s, 3) + " s"});
    const auto line = static_cast<double>(bars.y.categories.size());
    std::string label = name;
    std::replace(label.begin(), label.end(), '_', ' ');
    bars.y.categories.push_back(label);
    constexpr double kFloorN = 1.2e-4;  // zero has no place on a logarithmic axis
    our_dots.add(std::max(kFloorN, w.of.max_n), line - 0.12);
    their_dots.add(std::max(kFloorN, p.of.max_n), line + 0.12);
  }
  bars.series = {our_dots, their_dots};
  context.report.add_table(
      "trust_free_air", "Force where nothing is touched", table,
      fixed(*simulated.value, 0) + " simulated seconds, " + fixed(free_seconds, 0) +
          " of them in free air by the truth; tap_1d, explore_rod, explore_bearing and wall (away from its "
          "plane), both devices, 1 and 5 kHz, several seeds; 12.6 g tool, targets 0.7 and 0.8 N/mm. The tool "
          "rests and is waved ±20 mm at 2.2 Hz in all directions, or (abrupt hand, lab) moved with 400 mm/s "
          "and 20 m/s²; where an object is lost it is pressed or stroked before. A latched guard is cleared "
          "after 0.3 s. Contacts declared: where nothing was touched.");
  context.report.add_plot("trust_free_air", bars, {.height_px = 700});
}

}  // namespace hapticd::study
