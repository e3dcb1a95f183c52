#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <exception>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cpp/client.h"
#include "server/grpc/messages/telemetry_messages.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/daemon_process.h"
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
  rt::SceneOutline outline;
  std::string failed;
};

/// What the daemon takes with it.
struct DaemonCost {
  double start_ms = 0.0;
  double memory_mb = 0.0;
  std::vector<std::string> hardware;
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
  cost.outline = (*workload)->outline();
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

/// Resident memory in MB, from /proc/PID/status.
double resident_mb(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string word; file >> word;) {
    double kb = 0.0;
    if (word == "VmRSS:" && file >> kb) return 1e-3 * kb;
  }
  return 0.0;
}

DaemonCost daemon_cost(const std::string& scene, const std::filesystem::path& log) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  DaemonProcess daemon(log, {.scene = scene});
  const std::chrono::duration<double, std::milli> took = Clock::now() - start;
  client::Client client({.address = daemon.address()});
  const v1::SceneOutline outline = client.explain_scene({.name = scene});
  DaemonCost cost{took.count(), resident_mb(daemon.pid()), {}};
  cost.hardware.assign(outline.hardware().begin(), outline.hardware().end());
  daemon.stop();
  return cost;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : "; ") + name;
  return text;
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

/// One row a stage, one column a scene: what is left out is seen at once.
void add_stage_table(report::Report& report,
                     const std::vector<std::pair<std::string, rt::SceneOutline>>& outlines) {
  std::vector<std::string> headers{"stage"};
  std::vector<std::string> stages;
  for (const auto& [scene, outline] : outlines) {
    headers.push_back(scene);
    for (const std::string& stage : outline.stages) {
      if (std::find(stages.begin(), stages.end(), stage) == stages.end()) stages.push_back(stage);
    }
  }
  report::MarkdownTable table(headers);
  const auto add = [&](const std::string& what, const auto& text_of) {
    std::vector<std::string> row{what};
    for (const auto& [scene, outline] : outlines) row.push_back(text_of(outline));
    table.add_row(row);
  };
  for (const std::string& stage : stages) {
    add(stage, [&stage](const rt::SceneOutline& outline) {
      return std::find(outline.stages.begin(), outline.stages.end(), stage) != outline.stages.end() ? "yes"
                                                                                                    : "";
    });
  }
  add("hardware", [](const rt::SceneOutline& outline) { return joined(outline.hardware); });
  add("groups of telemetry",
      [](const rt::SceneOutline& outline) { return std::to_string(std::popcount(outline.channels)); });
  report.add_table("scenes_stages", "What each scene is made of", table);
}

void add_daemon_table(report::Report& report, bool quick) {
  const auto folder = report.folder() / "scenes";
  std::filesystem::create_directories(folder);
  report::MarkdownTable table(
      {"scene", "start to listening [ms]", "resident memory [MB]", "hardware opened", "failed"});
  for (const std::string scene : {"tap_1d", "wall", "explore_bearing", "explore_rod"}) {
    if (quick && scene != "tap_1d") continue;
    report::Figure start{.figure = "scene_start_ms", .conditions = {{"scene", scene}}, .unit = "ms"};
    report::Figure memory{.figure = "scene_daemon_memory_mb", .conditions = {{"scene", scene}}, .unit = "MB"};
    try {
      const DaemonCost cost = daemon_cost(scene, folder / (scene + ".log"));
      start.value = cost.start_ms;
      memory.value = cost.memory_mb;
      table.add_row({scene, fixed(cost.start_ms, 0), fixed(cost.memory_mb, 0), joined(cost.hardware), ""});
    } catch (const std::exception& error) {
      start.failed = memory.failed = error.what();
      table.add_row({scene, "", "", "", error.what()});
    }
    report.add(start);
    report.add(memory);
  }
  report.add_table(
      "scenes_daemon", "The daemon with one scene", table,
      "Of the whole program on the simulated rig, until it says that it listens; its memory is "
      "locked, so all that it may come to need is resident, thread stacks and telemetry included.");
}

}  // namespace

int run_scenes(const ScenesOptions& options) {
  report::Report report(options.folder);
  report.begin_section("report_scenes",
                       "What each scene costs, and what it would cost with everything forced on");
  std::vector<std::pair<std::string, rt::SceneOutline>> outlines;
  report::MarkdownTable table({"scene", "extent", "instructions per tick", "of the composed", "median [ns]",
                               "99.9 % [ns]", "memory [B]", "composed in [µs]", "telemetry [kB/s]",
                               "failed"});
  report::Plot plot;
  plot.title = "Instructions per tick";
  plot.y = {"instructions"};
  plot.y.minimum = 0.0;
  report::PlotSeries composed = report::dots("composed");
  report::PlotSeries forced = report::dots("everything forced on");
  composed.mark_size = forced.mark_size = 1.2;
  for (const std::string& scene : tick_scenes()) {
    if (options.quick && scene != "tap_1d" && scene != "explore_rod") continue;
    report::Report::note(scene);
    const TickCost own = cost_of(scene, Extent::kComposed, options.quick);
    const TickCost all = cost_of(scene, Extent::kEverything, options.quick);
    outlines.emplace_back(scene, own.outline);
    add_figures(report, scene, "composed", own);
    add_figures(report, scene, "everything", all);
    const double own_instructions = own.instructions.value_or(0.0);
    add_row(table, scene, "composed", own, own_instructions);
    add_row(table, scene, "everything", all, own_instructions);
    const auto at = static_cast<double>(plot.x.categories.size());
    plot.x.categories.push_back(scene);
    composed.add(at, own.instructions.value_or(0.0));
    forced.add(at, all.instructions.value_or(0.0));
  }
  plot.series = {composed, forced};
  add_stage_table(report, outlines);
  report.add_table(
      "scenes_cost", "What a tick of each scene costs", table,
      "The same samples for both: taps, in three dimensions strokes, of the simulated hand with the scene in "
      "the "
      "loop. Everything: the scene's own stages and those of all other kinds evaluated at every tick, all "
      "groups "
      "reported, as in a loop that composes nothing. Instructions by callgrind, telemetry record and guard "
      "included; memory is the heap of the stages and the object that runs and guards them; telemetry is one "
      "subscriber at 1 kHz with all groups the scene has.");
  report.add_plot("scenes_cost", plot, {.height_px = 400});
  add_daemon_table(report, options.quick);
  return 0;
}

}  // namespace hapticd::bench
