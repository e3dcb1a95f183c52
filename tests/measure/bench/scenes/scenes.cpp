#include <optional>
#include <string>

#include "server/grpc/messages/telemetry_messages.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/tick/tick_instructions.h"
#include "tests/measure/bench/tick/tick_timing.h"
#include "tests/measure/bench/tick/tick_workload.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

using report::fixed;
using report::kNoNumber;

/// What a scene costs in a tick.
struct TickCost {
  std::optional<double> instructions;
  TickTimes times;
  std::size_t memory_bytes = 0;
  double compose_us = 0.0;
  double telemetry_bytes_per_s = 0.0;
  std::string failed;
};

/// Mean size of a sample on the wire, all groups there are, times the rate.
double telemetry_bytes_per_s(TickWorkload& workload) {
  constexpr double kRateHz = 1000.0;
  double bytes = 0.0;
  for (std::size_t i = 0; i < workload.size(); ++i) {
    v1::TelemetryBatch alone;
    server::fill(workload.next_record(), ~0U, *alone.add_samples());
    bytes += static_cast<double>(alone.ByteSizeLong());
  }
  return kRateHz * bytes / static_cast<double>(workload.size());
}

TickCost cost_of(const std::string& scene, Extent extent, bool quick) {
  TickCost cost;
  const auto workload = TickWorkload::create(scene, extent);
  if (!workload) {
    cost.failed = workload.error().text();
    return cost;
  }
  cost.memory_bytes = (*workload)->memory_bytes();
  cost.compose_us = 1e-3 * (*workload)->compose_ns();
  cost.telemetry_bytes_per_s = telemetry_bytes_per_s(**workload);
  cost.times = time_ticks(**workload, quick ? 0.1 : 1.5);
  if (!(*workload)->renders()) cost.failed = "the guard latched; the tick rendered nothing";
  const InstructionCount count = count_instructions(scene, extent);
  cost.instructions = count.per_tick;
  if (!count.failed.empty()) cost.failed = count.failed;
  return cost;
}

void add_figures(report::Report& report, const std::string& scene, const char* extent, const TickCost& cost) {
  const auto add = [&](const char* figure, std::optional<double> value, const char* unit) {
    report.add({.figure = figure,
                .conditions = {{"scene", scene}, {"extent", extent}},
                .value = value,
                .unit = unit,
                .failed = cost.failed});
  };
  add("scene_cost_instructions", cost.instructions, "1");
  add("scene_cost_ns", cost.times.median_ns, "ns");
  add("scene_memory_bytes", static_cast<double>(cost.memory_bytes), "B");
  add("scene_telemetry_bytes_per_s", cost.telemetry_bytes_per_s, "B/s");
}

void add_row(report::MarkdownTable& table, const std::string& scene, const char* extent, const TickCost& cost,
             double own_instructions) {
  if (!cost.failed.empty()) {
    table.add_row({scene, extent, "", "", "", "", "", "", "", cost.failed});
    return;
  }
  table.add_row({scene, extent, cost.instructions ? fixed(*cost.instructions, 0) : kNoNumber,
                 cost.instructions ? fixed(*cost.instructions / own_instructions, 2) : kNoNumber,
                 fixed(cost.times.median_ns, 0), fixed(cost.times.p999_ns, 0),
                 std::to_string(cost.memory_bytes), fixed(cost.compose_us, 0),
                 fixed(1e-3 * cost.telemetry_bytes_per_s, 0), ""});
}

}  // namespace

int run_scenes(const ScenesOptions& options) {
  report::Report report(options.folder);
  report.begin_section("report_scenes",
                       "What each scene costs, and what it would cost with everything forced on");
  report::MarkdownTable table({"scene", "extent", "instructions per tick", "of the composed", "median [ns]",
                               "99.9 % [ns]", "memory [B]", "composed in [µs]", "telemetry [kB/s]",
                               "failed"});
  for (const std::string& scene : tick_scenes()) {
    if (options.quick && scene != "tap_1d" && scene != "explore_rod") continue;
    report::Report::note(scene);
    const TickCost own = cost_of(scene, Extent::kComposed, options.quick);
    const TickCost all = cost_of(scene, Extent::kEverything, options.quick);
    add_figures(report, scene, "composed", own);
    add_figures(report, scene, "everything", all);
    const double own_instructions = own.instructions.value_or(0.0);
    add_row(table, scene, "composed", own, own_instructions);
    add_row(table, scene, "everything", all, own_instructions);
  }
  report.add_table(
      "scenes_cost", "What a tick of each scene costs", table,
      "The same samples for both: taps, in three dimensions strokes, of the simulated hand with the scene in "
      "the "
      "loop. Everything: the scene's own stages and those of all other kinds evaluated at every tick, all "
      "groups "
      "reported, as in a loop that composes nothing. Instructions by callgrind, telemetry record and guard "
      "included; memory is the heap of the stages and the object that runs and guards them; telemetry is one "
      "subscriber at 1 kHz with all groups the scene has.");
  return 0;
}

}  // namespace hapticd::bench
