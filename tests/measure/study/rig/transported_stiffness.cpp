#include <algorithm>
#include <string>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/scenes.h"

namespace hapticd::study {

namespace {

using report::fixed;

/// One row: the same press by every transport.
struct Compared {
  std::string object;
  double target = 0.0;
  PressTask task;
  report::Case conditions;  ///< as the direct study gives them, but for the transport
  double goal = 0.05;
  bool by_board = true;  ///< whether the device's motors are for it
};

std::string percent(const PressOutcome& outcome, double target) {
  if (!outcome.failed.empty()) return report::kNoNumber;
  return fixed(100.0 * (outcome.rendered_n_per_mm / target - 1.0), 2);
}

/// Difference to the direct rig, in percent of the target.
std::string difference(const PressOutcome& outcome, const PressOutcome& direct, double target) {
  if (!outcome.failed.empty() || !direct.failed.empty()) return report::kNoNumber;
  return fixed(100.0 * (outcome.rendered_n_per_mm - direct.rendered_n_per_mm) / target, 2);
}

void add_figure(StudyContext& context, const Compared& compared, const char* transport,
                const PressOutcome& outcome) {
  report::Figure figure{"rendered_stiffness_error", compared.conditions};
  figure.conditions.emplace_back("transport", transport);
  figure.goal = compared.goal;
  figure.source = "D§3.3.2, D§4.6, D§4.7.2";
  if (outcome.failed.empty()) {
    figure.value = outcome.rendered_n_per_mm / compared.target - 1.0;
  } else {
    figure.failed = outcome.failed;
  }
  context.report.add(figure);
}

/// Errors of the direct rig with other noise: how far two runs of the same press lie apart anyway.
std::string spread(const Compared& compared) {
  constexpr std::uint64_t kSeeds = 6;
  double low = 1e9;
  double high = -1e9;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    PressTask task = compared.task;
    task.rig.seed = seed;
    const PressOutcome outcome = press_direct(task);
    if (!outcome.failed.empty()) continue;
    const double error = 100.0 * (outcome.rendered_n_per_mm / compared.target - 1.0);
    low = std::min(low, error);
    high = std::max(high, error);
  }
  return low > high ? std::string(report::kNoNumber) : fixed(low, 2) + " … " + fixed(high, 2);
}

report::MarkdownTable new_table() {
  return report::MarkdownTable({"object", "target N/mm", "press N", "direct %", "direct, 6 seeds %",
                                "board %", "emulated %", "board − direct", "emulated − direct", "attempts",
                                "longest gap ms", "ticks missed", "remark"});
}

void compare(StudyContext& context, const Compared& compared, report::MarkdownTable& table) {
  const PressOutcome direct = press_direct(compared.task);
  add_figure(context, compared, "direct", direct);
  PressOutcome board;
  if (compared.by_board) {
    board = press_on_board(compared.task);
    add_figure(context, compared, "board", board);
  } else {
    board.failed = "not run";
  }
  const LivePress live = press_emulated(compared.task);
  add_figure(context, compared, "emulated", live.outcome);

  std::string remark = live.outcome.failed;
  if (compared.by_board && !board.failed.empty()) {
    remark += (remark.empty() ? "" : "; ") + ("board: " + board.failed);
  }
  const Disturbance& machine = live.disturbance;
  table.add_row({compared.object, fixed(compared.target, 1), fixed(compared.task.hand.force_n, 2),
                 percent(direct, compared.target), spread(compared), percent(board, compared.target),
                 percent(live.outcome, compared.target), difference(board, direct, compared.target),
                 difference(live.outcome, direct, compared.target), std::to_string(live.attempts),
                 fixed(std::max(machine.longest_tick_gap_ms, machine.longest_world_gap_ms), 1),
                 std::to_string(machine.ticks_missed), remark.empty() ? report::kNoNumber : remark});
  report::Report::note(compared.object + ", " + fixed(compared.target, 1) + " N/mm: direct " +
                       percent(direct, compared.target) + " %, board " + percent(board, compared.target) +
                       " %, emulated " + percent(live.outcome, compared.target) + " %");
}

/// Half the force as long as device or sensor cannot do it, as in the direct study.
PressTask feasible_tap(const std::string& object, double target) {
  constexpr const char* kDevice = "phantom_1_0";
  double force_n = 2.0;
  PressTask task = tap_press(kDevice, object, target, true, force_n);
  while (!press_direct(task).failed.empty() && force_n > 0.3) {
    force_n *= 0.5;
    task = tap_press(kDevice, object, target, true, force_n);
  }
  return task;
}

constexpr const char* kHowLive =
    "True force of the hand over true displacement of the tip, mean of one second of the hold; errors "
    "relative to the target, differences in percent of it. Direct: simulated rig in virtual "
    "time, and the span of it over six seeds of its noise. Board: the "
    "same physics through analog inputs, encoder counters and motor outputs of a scripted board with the "
    "drivers daq and phantom, in virtual time. Emulated: live, the physics at 7 kHz, force through a Net F/T "
    "box over UDP and HTTP, the device through a stand-in for the vendor's library, whose scheduler is the "
    "clock. A live press in which ticks or physics paused for more than 20 ms is repeated, at most twice; "
    "gap and ticks missed are those of the attempt that counts.";

void compare_1d(StudyContext& context) {
  report::MarkdownTable table = new_table();
  for (const std::string& object : tapped_objects()) {
    if (context.quick && object != tapped_objects().front()) break;
    for (const double target : {0.3, 0.7}) {
      Compared compared;
      compared.object = object;
      compared.target = target;
      compared.task = feasible_tap(object, target);
      compared.conditions = {
          {"device", "phantom_1_0"}, {"object", object}, {"target", target}, {"compensation", "structural"}};
      compare(context, compared, table);
    }
  }
  context.report.add_table("transported_stiffness_1d", "One dimension, over the transports", table, kHowLive);
}

void compare_3d(StudyContext& context) {
  report::MarkdownTable table = new_table();
  for (const std::string object : {"sponge_cut", "foam_ball_3d"}) {
    for (const double target : {0.3, 0.8}) {
      if (context.quick && (object != "sponge_cut" || target != 0.3)) continue;
      Compared compared;
      compared.object = object;
      compared.target = target;
      PressTask& task = compared.task;
      task.rig = explore_rig("phantom_1_5_high_force", object, "ball_bearing");
      task.scene = explore_scene(rt::Tip::kBallBearing);
      task.scene.target = rt::linear_target(target);
      task.model = &identified(object).model;
      task.hand = pressing(4.0);
      task.judged_from_s = 2.5;
      task.judged_to_s = 3.5;
      compared.conditions = {{"object", object}, {"target", target}, {"pipeline", "default"}};
      compared.by_board = false;
      compare(context, compared, table);
    }
  }
  context.report.add_table("transported_stiffness_3d", "Three dimensions, over the transports", table,
                           std::string(kHowLive) +
                               " The board stands behind a Premium 1.5 and was not run with the high-force "
                               "device.");
}

}  // namespace

void run_transported_stiffness(StudyContext& context) {
  compare_1d(context);
  compare_3d(context);
}

}  // namespace hapticd::study
