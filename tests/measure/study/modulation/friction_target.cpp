#include <cmath>
#include <string>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/modulation/friction_trial.h"

namespace hapticd::study {

namespace {

using report::fixed;

report::Figure friction_figure(const char* name, const FrictionTrial& trial, const std::string& target) {
  return {name, {{"object", trial.object}, {"scale", target}, {"force_n", fixed(trial.force_n, 0)}}};
}

/// Why an outcome is none of the target's; empty if it is.
std::string failure(const FrictionOutcome& outcome, bool more) {
  constexpr double kBoundedShare = 0.5;
  if (!outcome.failed.empty()) return outcome.failed;
  return more && outcome.bounded_share > kBoundedShare ? "the target is out of the feasible range" : "";
}

void add_value(StudyContext& context, report::Figure figure, const std::string& failed, double value,
               double goal) {
  if (failed.empty()) {
    figure.value = value;
  } else {
    figure.failed = failed;
  }
  figure.goal = goal;
  context.report.add(figure);
}

}  // namespace

void run_friction_target(StudyContext& context) {
  report::MarkdownTable table({"object", "press N", "target", "at the hand", "error %", "with the fade %",
                               "presliding %", "above 20 Hz N", "of it wanted N", "remark"});
  for (const std::string& object : explored_objects()) {
    for (const double force_n : {1.0, 2.0}) {
      for (const double scale : {0.5, 0.75, 1.25, 1.5, 2.0}) {
        if (context.quick && (force_n != 1.0 || (scale != 0.5 && scale != 2.0))) continue;
        FrictionTrial trial;
        trial.object = object;
        trial.force_n = force_n;
        trial.target.emplace().scale = scale;
        const FrictionOutcome out = run_trial(trial);
        const std::string target = fixed(scale, 2);
        const std::string failed = failure(out, scale > 1.0);
        const double error = out.scale / scale - 1.0, whole = out.whole_scale / scale - 1.0;
        add_value(context, friction_figure("friction_target_error", trial, target), failed, error, 0.1);
        add_value(context, friction_figure("friction_target_error_with_fade", trial, target), failed, whole,
                  0.1);
        add_value(context, friction_figure("friction_presliding_error", trial, target), failed,
                  out.presliding_error, 0.2);
        add_value(context, friction_figure("friction_chatter_n", trial, target), failed, out.chatter_n, 0.1);
        table.add_row({object, fixed(force_n, 0), "x " + target, "x " + fixed(out.scale, 3),
                       fixed(100.0 * error, 1), fixed(100.0 * whole, 1),
                       fixed(100.0 * out.presliding_error, 1), fixed(out.chatter_n, 3),
                       fixed(std::abs(scale - 1.0) * out.real_chatter_n, 3), failed});
      }
    }
    for (const double coefficient : {0.4, 1.0}) {
      if (context.quick) continue;
      FrictionTrial trial;
      trial.object = object;
      trial.target.emplace().coefficient = coefficient;
      trial.stiffness_n_per_mm = 0.5;
      trial.force_n = 1.0;
      const FrictionOutcome out = run_trial(trial);
      const double error = out.hand_coefficient / coefficient - 1.0;
      const std::string failed = failure(out, coefficient > out.real_coefficient);
      add_value(context, friction_figure("friction_coefficient_error", trial, fixed(coefficient, 1)), failed,
                error, 0.1);
      table.add_row({object, "1", "coefficient " + fixed(coefficient, 1), fixed(out.hand_coefficient, 3),
                     fixed(100.0 * error, 1), "", fixed(100.0 * out.presliding_error, 1),
                     fixed(out.chatter_n, 3), "", failed});
    }
  }
  context.report.add_table(
      "friction_target", "Friction at the hand against its target", table,
      "Strokes of 30 mm, 60 mm/s; tangential force of object and device along the true motion. Error: in "
      "steady sliding, 0.2 s after it began; with the fade: from the first sliding on. Presliding: the slope "
      "at reversals; more friction keeps the distance over which it builds up, less keeps the slope. Above "
      "20 Hz: peak of the device's tangential force, 0.06 to 0.21 s after a reversal; wanted: what the "
      "object's own friction has there, times |scale - 1|. Coefficients: while a stiffness of 0.5 N/mm is "
      "rendered. Without back-drive compensation, whose force would count as friction.");
}

void run_friction_stiffness(StudyContext& context) {
  report::MarkdownTable table(
      {"object", "target N/mm", "scale", "held N/mm", "change %", "stroked N/mm", "change %"});
  for (const std::string& object : explored_objects()) {
    for (const double stiffness : {0.3, 0.8}) {
      double held_before = 0.0, stroked_before = 0.0;
      for (const double scale : {1.0, 0.5, 2.0}) {
        if (context.quick && scale == 0.5) continue;
        PressTask task;
        task.rig = explore_rig("phantom_1_5_high_force", object, "rod");
        task.scene = explore_scene(rt::Tip::kRod);
        task.scene.target = rt::linear_target(stiffness);
        if (scale != 1.0) task.scene.friction_target.emplace().scale = scale;
        task.model = &identified(object).model;
        task.hand = {.kind = sim::HandProgram::Kind::kPress, .force_n = 2.0, .hold_s = -1.0};
        const double held = press_direct(task).rendered_n_per_mm;
        FrictionTrial trial;
        trial.object = object;
        trial.force_n = 1.0;
        trial.stiffness_n_per_mm = stiffness;
        if (scale != 1.0) trial.target.emplace().scale = scale;
        const double stroked = run_trial(trial).stroked_n_per_mm;
        if (scale == 1.0) {
          held_before = held;
          stroked_before = stroked;
        }
        const double held_change = held / held_before - 1.0, stroked_change = stroked / stroked_before - 1.0;
        table.add_row({object, fixed(stiffness, 1), fixed(scale, 1), fixed(held, 4),
                       fixed(100.0 * held_change, 2), fixed(stroked, 4), fixed(100.0 * stroked_change, 2)});
        if (scale == 1.0) continue;
        for (const bool stroking : {false, true}) {
          report::Figure figure{"friction_stiffness_change",
                                {{"object", object},
                                 {"scale", fixed(scale, 1)},
                                 {"target", stiffness},
                                 {"hand", stroking ? "strokes" : "holds"}}};
          figure.value = stroking ? stroked_change : held_change;
          figure.goal = 0.01;
          context.report.add(figure);
        }
      }
    }
  }
  context.report.add_table(
      "friction_stiffness", "Stiffness with a friction target and without", table,
      "At the simulated hand; held: 2 N, mean of one second; stroked: 1 N, along the true "
      "normal. Scale 1.0 is the scene without [friction_target].");
}

}  // namespace hapticd::study
