#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/trust/trust_study.h"
#include "tests/measure/study/trust/trust_trial.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::demand;
using test::value_of;

/// Taps and presses of one object in one scene under one cause.
struct ContactCase {
  TrustCase trial;
  std::string object;
};

struct Contacts {
  int taps = 0;
  int missed = 0;
  int presses = 0;
  int presses_missed = 0;
  int dropped = 0;      ///< contacts ended while the object was pressed with more than 0.2 N
  double lost_s = 0.0;  ///< under such a force, but not declared
  double held_s = 0.0;
  double withdrawn = 0.0;
  int withdrawn_touching = 0;  ///< of those, while the object was touched
  std::vector<double> delays_ms;

  report::CellValues values() const {
    report::CellValues all{static_cast<double>(taps),
                           static_cast<double>(missed),
                           static_cast<double>(presses),
                           static_cast<double>(presses_missed),
                           static_cast<double>(dropped),
                           lost_s,
                           held_s,
                           withdrawn,
                           static_cast<double>(withdrawn_touching)};
    all.insert(all.end(), delays_ms.begin(), delays_ms.end());
    return all;
  }
  void add(const report::CellValues& v) {
    taps += static_cast<int>(v[0]);
    missed += static_cast<int>(v[1]);
    presses += static_cast<int>(v[2]);
    presses_missed += static_cast<int>(v[3]);
    dropped += static_cast<int>(v[4]);
    lost_s += v[5];
    held_s += v[6];
    withdrawn += v[7];
    withdrawn_touching += static_cast<int>(v[8]);
    delays_ms.insert(delays_ms.end(), v.begin() + 9, v.end());
  }
  double mean_ms() const {
    double sum = 0.0;
    for (const double d : delays_ms) sum += d;
    return delays_ms.empty() ? std::numeric_limits<double>::quiet_NaN()
                             : sum / static_cast<double>(delays_ms.size());
  }
  double max_ms() const {
    return delays_ms.empty() ? std::numeric_limits<double>::quiet_NaN()
                             : *std::max_element(delays_ms.begin(), delays_ms.end());
  }
};

struct Act {
  double from_s;
  sim::HandProgram program;
};

std::vector<Act> acts_of(bool explores, double& until_s) {
  std::vector<Act> acts{{0.0, sim::HandProgram{}}};
  double at_s = 4.0;  // what comes later than biasing has come by then
  constexpr int kTaps = 4;
  for (const double speed : {100.0, 400.0}) {
    sim::HandProgram taps = tapping(speed, kTaps);
    if (explores && speed > 200.0) taps.tap_slant_deg = 30.0;
    acts.push_back({at_s, taps});
    at_s += 2.0 + kTaps / taps.rate_hz;
  }
  for (const double force_n : {1.0, 3.0}) {
    sim::HandProgram press = pressing(force_n);
    press.hold_s = 2.0;
    press.force_rate_n_per_s = 2.0;
    press.approach_mm_per_s = 30.0;
    acts.push_back({at_s, press});
    at_s += sim::planned_duration_s(press);
  }
  until_s = at_s;
  return acts;
}

Contacts touch(const ContactCase& contact, const TrustModels& models) {
  sim::SimulationConfig config = trust_rig(contact.trial);
  config.object = contact.object;
  const auto rig = value_of(create_rig(config));
  rt::SceneSpec spec = trust_scene(contact.trial);
  spec.target = rt::linear_target(0.4);
  rt::SceneSpec scene = value_of(rt::resolve(spec, rig->info()));
  if (contact.trial.published) scene.guard.renders_real_object = false;  // it had no such guard
  const auto pipeline =
      value_of(rt::compose(scene, rig->info(), contact.trial.published ? models.published : models.ours));
  rt::Renderer renderer(scene.guard, contact.trial.rate_hz);
  renderer.exchange(pipeline.get(), scene.guard);
  double until_s = 0.0;
  const std::vector<Act> acts = acts_of(contact.trial.scene != "tap_1d", until_s);

  Contacts result;
  std::size_t next_act = 0;
  hal::RigSample sample;
  hal::TruthSample truth;
  rt::TickRecord record;
  hal::Vector3 before_mm;
  double before_s = 0.0;
  double touching_s = -1.0;  // last tick in contact
  double touched_s = -1.0;   // of the contact that waits to be declared
  bool pressing_now = false;
  bool found = false;
  bool was_declared = false;
  std::uint32_t withdrawn = 0;
  double pressed_since_s = -1.0;
  double silent_since_s = -1.0;
  for (double now_s = 0.0; now_s < until_s;) {
    if (next_act < acts.size() && acts[next_act].from_s <= now_s) {
      pressing_now = acts[next_act].program.kind == sim::HandProgram::Kind::kPress;
      demand(rig->set_program(acts[next_act++].program));
    }
    rig->read(sample);
    rig->truth(truth);
    record = rt::TickRecord{};
    rig->write(renderer.tick(sample, record));
    now_s = 1e-9 * static_cast<double>(sample.time_ns);
    const double approach_mm_per_s =
        -dot(truth.tip_position_mm - before_mm, truth.outward_normal) / std::max(1e-6, now_s - before_s);

    constexpr double kFlightS = 0.1;
    if (truth.in_contact) {
      if (now_s - touching_s > kFlightS && touched_s < 0.0) {  // out of free flight, not a bounce
        touched_s = now_s - truth.displacement_mm / std::max(1.0, approach_mm_per_s);
        found = false;
        ++(pressing_now ? result.presses : result.taps);
      }
      touching_s = now_s;
    }
    if (touched_s >= 0.0 && !found && record.in_contact) {
      found = true;
      if (!pressing_now) result.delays_ms.push_back(1e3 * (now_s - touched_s));
    }
    if (touched_s >= 0.0 && !truth.in_contact && now_s - touching_s > kFlightS) {
      if (!found) ++(pressing_now ? result.presses_missed : result.missed);
      touched_s = -1.0;
    }

    constexpr double kPressedN = 0.2;
    if (truth.normal_force_n > kPressedN) {
      if (pressed_since_s < 0.0) pressed_since_s = now_s;
      constexpr double kSettledS = 0.05;
      if (now_s - pressed_since_s > kSettledS) {
        result.held_s += now_s - before_s;
        if (!record.in_contact) result.lost_s += now_s - before_s;
        if (was_declared && !record.in_contact) ++result.dropped;
      }
    } else {
      pressed_since_s = -1.0;
    }
    was_declared = record.in_contact;
    if (withdrawn_contacts(record) > withdrawn && truth.in_contact) ++result.withdrawn_touching;
    withdrawn = withdrawn_contacts(record);
    before_mm = truth.tip_position_mm;
    before_s = now_s;

    if (record.guard_state == rt::GuardState::kLatched || record.guard_state == rt::GuardState::kSuspended) {
      if (silent_since_s < 0.0) silent_since_s = now_s;
      constexpr double kClearedAfterS = 0.3;
      if (now_s - silent_since_s > kClearedAfterS && renderer.clear()) silent_since_s = -1.0;
    } else {
      silent_since_s = -1.0;
    }
  }
  result.withdrawn = withdrawn_contacts(record);
  return result;
}

std::vector<ContactCase> cases_of(bool quick) {
  const std::vector<std::string> tapped{"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"};
  std::vector<ContactCase> all;
  for (const TrustCause& cause : trust_causes()) {
    if (cause.needs_object || (quick && !cause.in_test)) continue;
    for (const std::string scene : {"tap_1d", "explore_bearing"}) {
      const auto& objects = scene == "tap_1d" ? tapped : explored_objects();
      for (const std::string& object : objects) {
        if (quick && &object != &objects[1]) continue;
        ContactCase contact;
        contact.trial.cause = &cause;
        contact.trial.scene = scene;
        contact.trial.device = scene == "tap_1d" ? "phantom_1_0" : "phantom_1_5_high_force";
        contact.trial.seed = 11;
        contact.object = object;
        all.push_back(contact);
      }
    }
  }
  return all;
}

/// Round 1's mean delay, on a quiet clock.
std::optional<double> reference_ms(const ContactCase& contact) {
  static const std::map<std::string, double> known{
      {"sponge_cut", 2.0}, {"foam_ball_3d", 1.4}, {"rubber_ball_3d", 1.1}, {"silicone_rest", 1.1}};
  const auto at = known.find(contact.object);
  if (at == known.end()) return std::nullopt;
  return at->second;
}

}  // namespace

void run_contact_kept(StudyContext& context) {
  const std::vector<ContactCase> cases = cases_of(context.quick);
  std::map<std::string, TrustModels> models;
  for (const std::string& object : explored_objects()) {
    if (context.quick && object != explored_objects()[1]) continue;
    const IdentificationResult& known = identified(object);
    models[object] = {&known.model, &known.dissertation};
  }
  const auto cells = context.cells.values("trust_contact_kept", cases.size(), [&](std::size_t cell) {
    const auto at = models.find(cases[cell].object);
    return touch(cases[cell], at == models.end() ? TrustModels{} : at->second).values();
  });
  if (!cells) return;

  std::map<std::string, Contacts> by_cause, by_scene, quiet;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const TrustCause& cause = *cases[i].trial.cause;
    by_cause[cause.name].add((*cells)[i]);
    by_scene[cause.label() + cases[i].trial.scene].add((*cells)[i]);
    if (cause.name != "nothing") continue;
    report::Figure figure{"trust_contact_delay_mean_ms",
                          {{"object", cases[i].object}, {"scene", cases[i].trial.scene}}};
    Contacts one;
    one.add((*cells)[i]);
    figure.unit = "ms";
    figure.value = one.mean_ms();
    figure.reference = reference_ms(cases[i]);
    figure.source = "reference: before contacts had to show evidence, taps of 100 … 600 mm/s";
    context.report.add(figure);
  }
  report::MarkdownTable table({"cause", "scene", "taps", "missed", "mean delay ms", "largest ms", "presses",
                               "missed", "contacts dropped under force", "time lost under force", "withdrawn",
                               "of those while touching"});
  report::SvgPlot plot;
  plot.title = "Mean delay of contact detection under each cause";
  plot.x = {"mean delay", "ms", true, 0.3, 300.0};
  plot.height_px = 900;
  report::PlotSeries lines[] = {{"tap_1d", {}, {}, report::PlotSeries::Style::kPoints, 0},
                                {"explore_bearing", {}, {}, report::PlotSeries::Style::kPoints, 1}};
  for (report::PlotSeries& line : lines) line.point_size = 1.0;
  for (const TrustCause& cause : trust_causes()) {
    bool shown = false;
    for (const std::string scene : {"tap_1d", "explore_bearing"}) {
      const auto at = by_scene.find(cause.label() + scene);
      if (at == by_scene.end()) continue;
      const Contacts& c = at->second;
      table.add_row({cause.label(), scene, std::to_string(c.taps), std::to_string(c.missed),
                     fixed(c.mean_ms(), 2), fixed(c.max_ms(), 2), std::to_string(c.presses),
                     std::to_string(c.presses_missed), std::to_string(c.dropped),
                     fixed(c.held_s > 0.0 ? 100.0 * c.lost_s / c.held_s : 0.0, 1) + " %",
                     fixed(c.withdrawn, 0), std::to_string(c.withdrawn_touching)});
      lines[scene == "tap_1d" ? 0 : 1].add(c.mean_ms(), static_cast<double>(plot.y.categories.size()));
      shown = true;
    }
    if (shown) plot.y.categories.push_back(cause.label());
  }
  plot.series = {lines[0], lines[1]};
  std::vector<std::string> reported;
  for (const TrustCause& cause : trust_causes()) {
    const auto at = by_cause.find(cause.name);
    if (at == by_cause.end() || std::find(reported.begin(), reported.end(), cause.name) != reported.end())
      continue;
    reported.push_back(cause.name);
    const Contacts& c = at->second;
    report::Figure missed{"contact_missed", {{"cause", cause.name}}};
    missed.value = c.missed + c.presses_missed;
    missed.goal = 0.0;
    missed.source = "of " + std::to_string(c.taps + c.presses) + " taps and presses";
    context.report.add(missed);
    report::Figure dropped{"contact_dropped", {{"cause", cause.name}}};
    dropped.value = c.dropped;
    dropped.goal = 0.0;
    dropped.source = "contacts that ended while the object was pressed with more than 0.2 N";
    context.report.add(dropped);
    report::Figure delay{"contact_delay_under_cause_ms", {{"cause", cause.name}}};
    delay.unit = "ms";
    delay.value = c.mean_ms();
    context.report.add(delay);
  }
  context.report.add_table(
      "trust_contact_kept", "Real contacts under the same causes", table,
      "Four objects a scene, each tapped with 100 and 400 mm/s (in three dimensions the latter slanted by "
      "30°) and "
      "pressed with 1 and 3 N at a target of 0.4 N/mm. Missed: not declared before the tip was free again. "
      "Dropped: "
      "the contact ended while the object was pressed with more than 0.2 N; time lost: not declared then.");
  context.report.add_plot("trust_contact_delay", plot);
}

}  // namespace hapticd::study
