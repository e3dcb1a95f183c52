#include <iostream>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/tick/tick_hours.h"
#include "tests/measure/bench/tick/tick_instructions.h"
#include "tests/measure/bench/tick/tick_timing.h"
#include "tests/measure/bench/tick/tick_workload.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

constexpr double kGoalMedianNs = 500.0;          // in 1D
constexpr double kGoalExploreMedianNs = 1000.0;  // all stages of 3D
constexpr double kGoalExploreP999Ns = 3000.0;

void measure(report::Report& report, report::MarkdownTable& table, const std::string& scene, double seconds) {
  const report::Case conditions{{"scene", scene}};
  report::Figure median{
      .figure = "tick_median_ns", .conditions = conditions, .unit = "ns", .goal = kGoalMedianNs};
  report::Figure p999{.figure = "tick_p999_ns", .conditions = conditions, .unit = "ns"};
  report::Figure instructions{.figure = "tick_instructions", .conditions = conditions};

  if (scene.starts_with("explore")) {
    median.goal = kGoalExploreMedianNs;
    p999.goal = kGoalExploreP999Ns;
  }

  const auto workload = TickWorkload::create(scene);
  if (!workload) {
    median.failed = p999.failed = instructions.failed = workload.error().text();
    report::Report::note(workload.error().text());
  } else {
    const TickTimes times = time_ticks(**workload, seconds);
    median.value = times.median_ns;
    p999.value = times.p999_ns;
    if (!(*workload)->renders()) median.failed = p999.failed = "the guard latched; the tick rendered nothing";
    const InstructionCount count = count_instructions(scene);
    instructions.value = count.per_tick;
    instructions.failed = count.failed;
    if (!count.failed.empty()) report::Report::note(scene + ": no instruction count: " + count.failed);

    using report::fixed;
    table.add_row({scene, fixed(times.median_ns, 1), fixed(times.free_median_ns, 1),
                   fixed(times.contact_median_ns, 1), fixed(times.p999_ns, 0),
                   count.per_tick ? fixed(*count.per_tick, 0) : report::kNoNumber,
                   fixed(100.0 * (*workload)->contact_share(), 0)});
  }
  for (const report::Figure& figure : {median, p999, instructions}) report.add(figure);
}

void measure_rest(report::Report& report, double hours) {
  using report::fixed;
  report::MarkdownTable table(
      {"scene", "laid down seconds ago [ns]", "flushed", "slowest minute", "kept", "slowest minute"});
  for (const std::string& scene : tick_scenes()) {
    const auto figure = [&](const char* denormals) {
      return report::Figure{.figure = "tick_rest_ratio",
                            .conditions = {{"scene", scene}, {"denormals", denormals}, {"hours", hours}}};
    };
    report::Figure flushed = figure("flushed");
    report::Figure kept = figure("kept");
    const auto times = time_rest(scene, hours);
    if (!times) {
      flushed.failed = kept.failed = times.error().text();
    } else {
      flushed.value = times->flushed_ratio;
      kept.value = times->kept_ratio;
      table.add_row({scene, fixed(times->fresh_ns, 1), fixed(times->flushed_ratio, 3),
                     fixed(times->flushed_slowest, 2), fixed(times->kept_ratio, 3),
                     fixed(times->kept_slowest, 2)});
    }
    report.add(flushed);
    report.add(kept);
  }
  report.add_table("tick_rest", "Ticks while a tool lies still for hours after a contact", table,
                   "As multiples of the ticks of a tool that was laid down seconds ago, taken in turns of 60 "
                   "ticks: median of the last thirty minutes of " +
                       fixed(hours, 1) +
                       " h, and the slowest of all minutes. Flushed: denormal numbers count as zero, as in "
                       "the loop's thread. Kept: what it would be without.");
}

}  // namespace

int run_tick(const TickOptions& options) {
  report::Report report(options.folder);
  report::MarkdownTable table({"scene", "median [ns]", "free [ns]", "in contact [ns]", "99.9 % [ns]",
                               "instructions", "samples in contact [%]"});
  for (const std::string& scene : tick_scenes()) measure(report, table, scene, options.seconds_per_scene);
  report.add_table(
      "tick", "One tick, its telemetry record included", table,
      "Medians over batches of 32 ticks, 99.9 % over single ticks less the clock's own cost; "
      "instructions as\n"
      "callgrind counts them. Samples are taps of the simulated hand; in 3D strokes back and forth.");
  if (options.resting_hours > 0.0) measure_rest(report, options.resting_hours);
  return 0;
}

int run_tick_child(const std::string& scene, long ticks, bool everything) {
  const auto workload = TickWorkload::create(scene, everything ? Extent::kEverything : Extent::kComposed);
  if (!workload) {
    std::cerr << workload.error().text() << std::endl;
    return 1;
  }
  for (long i = 0; i < ticks; ++i) (*workload)->tick();
  run_counted(**workload, ticks);
  return (*workload)->renders() ? 0 : 1;
}

}  // namespace hapticd::bench
