#include <string>
#include <utility>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/modulation/transient_trial.h"

namespace hapticd::study {

namespace {

using report::fixed;

/// Stiffness of the object as D§3.4 and D§4 measured it: what a user would write into the scene.
double known_n_per_mm(const std::string& object) {
  return object == "rubber_eraser" ? 2.26 : 0.18;
}

rt::TransientParameters one_mode(double frequency_hz, double object_n_per_mm = 0.0) {
  rt::TransientParameters transient;
  transient.target = {{frequency_hz, 80.0, 15.0}};
  transient.grip.object_stiffness_n_per_mm = object_n_per_mm;
  return transient;
}

void add_transient(StudyContext& context, const char* name, report::Case conditions, double value,
                   double goal) {
  report::Figure figure{name, std::move(conditions)};
  figure.value = value;
  figure.goal = goal;
  context.report.add(figure);
}

/// A displacement profile whose force steps up by `shift_n` at 0.5 mm, over 0.2 mm, and then goes on at `k`.
rt::TargetLaw shifted(double k, double shift_n) {
  constexpr double kAtMm = 0.5;
  constexpr double kWidthMm = 0.2;
  rt::TargetLaw law;
  law.kind = rt::TargetLaw::Kind::kDisplacementProfile;
  law.knots[0] = {kAtMm, k};
  law.knots[1] = {kAtMm + 0.5 * kWidthMm, k + 2.0 * shift_n / kWidthMm};
  law.knots[2] = {kAtMm + kWidthMm, k};
  law.knot_count = 3;
  return law;
}

/// Stiffness at the hand that presses 2 N, from and to so many seconds after it has built up, at 1 kHz.
double held_n_per_mm(const TransientTrial& trial, double from_s, double to_s) {
  PressTask task;
  task.rig = explore_rig(trial.device, trial.object, "ball_bearing");
  task.scene = explore_scene(rt::Tip::kBallBearing);
  task.scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  task.scene.target = *trial.target;
  task.scene.transient = trial.transient;
  task.hand.kind = sim::HandProgram::Kind::kPress;
  task.hand.force_n = 2.0;
  task.hand.force_rate_n_per_s = 20.0;
  task.hand.approach_mm_per_s = 100.0;
  task.hand.hold_s = -1.0;
  task.judged_from_s = from_s;
  task.judged_to_s = to_s;
  return press_direct(task).rendered_n_per_mm;
}

}  // namespace

void run_transient_frequency(StudyContext& context) {
  report::MarkdownTable table({"device", "object", "rate Hz", "target Hz", "frequency Hz", "error %",
                               "decay error %", "largest m/s²", "asked m/s²", "residual"});
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (const char* object : {"sponge_block", "rubber_eraser"}) {
      for (const double rate_hz : {5000.0, 1000.0}) {
        TransientTrial trial;
        trial.device = device;
        trial.object = object;
        trial.rate_hz = rate_hz;
        const TapLog without = tap(trial);
        for (const double hz : {30.0, 60.0, 100.0, 150.0, 200.0, 300.0}) {
          if (context.quick && hz != 100.0) continue;
          const report::Case conditions{
              {"hz", fixed(hz, 0)}, {"rate_hz", fixed(rate_hz, 0)}, {"device", device}, {"object", object}};
          const std::vector<std::string> head{device, object, fixed(rate_hz, 0), fixed(hz, 0)};
          const auto add_row = [&](std::vector<std::string> rest) {
            std::vector<std::string> row = head;
            row.insert(row.end(), rest.begin(), rest.end());
            row.resize(10);
            table.add_row(row);
          };
          if (hz > rt::highest_transient_hz(rate_hz)) {
            report::Figure figure{"transient_frequency_error", conditions};
            figure.failed = "refused: more than 0.15 of the rate";
            context.report.add(figure);
            add_row({"refused"});
            continue;
          }
          trial.transient = one_mode(hz, known_n_per_mm(object));
          const TapLog with = tap(trial);
          const DecayFit fit = fit_added(with, without, trial.transient->target[0]);
          const double f_error = fit.frequency_hz / hz - 1.0, b_error = fit.decay_per_s / 80.0 - 1.0;
          add_transient(context, "transient_frequency_error", conditions, f_error, 0.1);
          add_transient(context, "transient_decay_error", conditions, b_error, 0.2);
          add_transient(context, "transient_amplitude_share", conditions, with.amplitude_share, 1.0);
          add_row({fixed(fit.frequency_hz, 1), fixed(100.0 * f_error, 1), fixed(100.0 * b_error, 1),
                   fixed(fit.amplitude, 2), fixed(15e-3 * with.estimated_mm_per_s, 2),
                   fixed(fit.residual, 2)});
        }
      }
    }
  }
  context.report.add_table(
      "transient_frequency", "Contact transients at the grip", table,
      "A tap of 200 mm/s; the true acceleration of the tip with the transient less that without, fitted by "
      "one decaying sinusoid with its smooth beginning, 80 ms. Target decay 80 1/s, largest acceleration 15 "
      "1/s times the speed, as far as 3 N and the bounds of energy and rate allow. The dynamics given are "
      "those of the device preset and the simulated hand.");
}

void run_transient_hardness(StudyContext& context) {
  report::MarkdownTable table({"object", "what", "onset ms", "object and motors N/mm", "ratio", "hand N/mm",
                               "ratio", "held N/mm", "change %"});
  for (const char* object : {"sponge_block", "foam_ball", "rubber_eraser"}) {
    TransientTrial trial;
    trial.device = "phantom_1_5_high_force";
    trial.object = object;
    trial.target = rt::linear_target(0.4);
    const TapLog plain = tap(trial);
    const double plain_given = plain.rate_hardness_n_per_mm(plain.given_n);
    const double plain_hand = plain.rate_hardness_n_per_mm(plain.hand_n);
    const double plain_held = held_n_per_mm(trial, 0.5, 1.0), plain_soon = held_n_per_mm(trial, 0.0, 0.2);
    const auto add = [&](const std::string& what) {
      const TapLog log = tap(trial);
      const double given = log.rate_hardness_n_per_mm(log.given_n);
      const double hand = log.rate_hardness_n_per_mm(log.hand_n);
      const bool is_transient = trial.transient.has_value();
      // The press is at 1 kHz.
      const bool fits =
          !is_transient || trial.transient->target[0].frequency_hz <= rt::highest_transient_hz(1000.0);
      const double change = fits ? held_n_per_mm(trial, 0.5, 1.0) / plain_held - 1.0 : 0.0;
      table.add_row({object, what, is_transient ? fixed(log.onset_ms(), 1) : "", fixed(given, 3),
                     fixed(given / plain_given, 1), fixed(hand, 3), fixed(hand / plain_hand, 1),
                     fits ? fixed(plain_held * (1.0 + change), 4) : "",
                     fits ? fixed(100.0 * change, 2) : ""});
      const report::Case conditions{{"object", object}, {"what", what}};
      for (const bool at_hand : {false, true}) {
        report::Case port = conditions;
        port.emplace_back("port", at_hand ? "hand" : "object and motors");
        add_transient(context, "rate_hardness_ratio", port, at_hand ? hand / plain_hand : given / plain_given,
                      3.0);
      }
      if (fits) add_transient(context, "transient_stiffness_change", conditions, change, 0.01);
      if (!is_transient) return;
      add_transient(context, "transient_onset_ms", conditions, log.onset_ms(), 2.0);
      if (fits) {
        add_transient(context, "transient_stiffness_change_at_once", conditions,
                      held_n_per_mm(trial, 0.0, 0.2) / plain_soon - 1.0, 0.01);
      }
    };
    add("nothing");
    for (const double hz : {100.0, 300.0}) {
      for (const bool needs_evidence : {true, false}) {
        trial.transient = one_mode(hz);
        trial.transient->needs_evidence = needs_evidence;
        add("transient " + fixed(hz, 0) + " Hz" + (needs_evidence ? "" : ", without evidence"));
      }
    }
    trial.transient.reset();
    for (const double shift_n : {0.05, 0.1, 0.2}) {
      trial.target = shifted(0.4, shift_n);
      add("stiffness shifted by " + fixed(shift_n, 2) + " N");
    }
  }
  context.report.add_table(
      "transient_hardness", "Extended rate-hardness: transients and stiffness shifting", table,
      "A tap of 200 mm/s at 5 kHz on the high-force device, target 0.4 N/mm; largest rise of the force over "
      "1 ms within 20 ms of the contact over the true speed of the impact. Object and motors: the sum of "
      "their forces; hand: what the simulated hand bears. Held: a press of 2 N at 1 kHz, mean from 0.5 to 1 "
      "s after it built up. Stiffness shifting (Han, Jeon, Choi 2009): the target's force steps up at 0.5 "
      "mm. At 300 Hz there is no press, 1 kHz refuses it.");
}

}  // namespace hapticd::study
