#include "tests/bench/realtime/loop_under_load.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <thread>

#include "client/cpp/client.h"
#include "tests/bench/live/cyclictest.h"
#include "tests/bench/live/daemon_process.h"
#include "tests/bench/realtime/load.h"

namespace hapticd::bench {
namespace {

using report::fixed;
using report::kNoNumber;

constexpr double kGoalOverCyclictest = 1.1;
constexpr double kGoalOverIdle = 1.1;

/// What one load did to the loop, all rounds together.
struct LoopTimes {
  LatencyDistribution wakeup;
  LatencyDistribution compute;
  LatencyDistribution device;
  LatencyDistribution cyclictest;
  std::uint64_t periods_missed = 0;
  std::string failed;  ///< why there is nothing, or nothing to compare with
};

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// A second more than is measured, so that a load is there from the first to the last tick.
constexpr double kStartS = 0.5;

void measure_round(LoopTimes& times, const LoadType& type, client::Client& client, double seconds,
                   const std::filesystem::path& folder) {
  const auto load = type.start(client.address(), seconds + 2.0 * kStartS, folder);
  sleep_s(kStartS);
  const v1::LoopState before = client.rig_state().loop();
  Cyclictest cyclictest(seconds, folder / "cyclictest.txt");
  sleep_s(seconds);
  const v1::LoopState after = client.rig_state().loop();
  const Cyclictest::Outcome yardstick = cyclictest.finish();
  times.wakeup += between(before.wakeup(), after.wakeup());
  times.compute += between(before.compute(), after.compute());
  times.device += between(before.device(), after.device());
  times.periods_missed += after.periods_missed() - before.periods_missed();
  if (yardstick.wakeup) {
    times.cyclictest += *yardstick.wakeup;
  } else {
    times.failed = yardstick.failed;
  }
}

/// Two of the same beside each other: what two that differ in nothing differ by on this machine.
struct Twins {
  LatencyDistribution a;
  LatencyDistribution b;
  std::string failed;
};

void measure_twins(Twins& twins, double seconds, const std::filesystem::path& folder) {
  Cyclictest first(seconds, folder / "cyclictest_a.txt");
  Cyclictest second(seconds, folder / "cyclictest_b.txt");
  const Cyclictest::Outcome a = first.finish();
  const Cyclictest::Outcome b = second.finish();
  if (a.wakeup) twins.a += *a.wakeup;
  if (b.wakeup) twins.b += *b.wakeup;
  if (!a.wakeup) twins.failed = a.failed;
}

void add_twins(report::Report& report, const Twins& twins) {
  const double ratio = twins.a.quantile_us(0.999) / twins.b.quantile_us(0.999);
  report.add({.figure = "wakeup_p999_of_twins",
              .conditions = {{"source", "cyclictest beside cyclictest"}},
              .value = std::max(ratio, 1.0 / ratio),
              .source = "ratio of the larger to the smaller",
              .failed = twins.failed});
  report.say("Two cyclictests beside each other, as often and as long: 99 % at " +
             fixed(twins.a.quantile_us(0.99), 0) + " and " + fixed(twins.b.quantile_us(0.99), 0) +
             " µs, 99.9 % at " + fixed(twins.a.quantile_us(0.999), 0) + " and " +
             fixed(twins.b.quantile_us(0.999), 0) +
             " µs. Ratios nearer to one than theirs are not resolved on this machine.");
}

report::PlotSeries curve(const std::string& label, const LatencyDistribution& distribution, int colour,
                         bool dashed) {
  report::PlotSeries series;
  series.label = label;
  series.colour = colour;
  series.dashed = dashed;
  const std::vector<double> beyond = distribution.beyond();
  for (std::size_t i = 0; i < beyond.size(); ++i) {
    if (beyond[i] <= 0.0) continue;  // the last bin; there is no zero on a logarithmic axis
    series.x.push_back(distribution.bins[i].up_to_us);
    series.y.push_back(beyond[i]);
  }
  return series;
}

report::SvgPlot empty_plot(const std::string& title, const std::string& what) {
  report::SvgPlot plot;
  plot.title = title;
  plot.x = {what, "µs", true};
  plot.y = {"share of ticks that took longer", "", true};
  return plot;
}

class LoopReport {
 public:
  LoopReport(report::Report& report, const LoopTimes& idle) : report_(report), idle_(idle) {}

  void add(const LoadType& type, const LoopTimes& times) {
    const double wakeup = times.wakeup.quantile_us(0.999);
    const double yardstick = times.cyclictest.quantile_us(0.999);
    const double idle = idle_.wakeup.quantile_us(0.999);
    add_figure("wakeup_p999_us", type, "hapticd", wakeup, kGoalOverCyclictest * yardstick, yardstick,
               "cyclictest in the same seconds", times);
    add_figure("wakeup_p999_us", type, "cyclictest", yardstick, {}, {}, "", times);
    add_figure("compute_p999_us", type, "hapticd", times.compute.quantile_us(0.999), {}, {}, "", times);
    add_figure("device_p999_us", type, "hapticd", times.device.quantile_us(0.999), {}, {}, "", times);
    if (type.kind == LoadKind::kService) {
      add_figure("wakeup_p999_over_idle", type, "hapticd", wakeup / idle, kGoalOverIdle, {},
                 "the same run without load", times, "1");
      add_figure("wakeup_p999_over_idle", type, "cyclictest", yardstick / idle_.cyclictest.quantile_us(0.999),
                 {}, {}, "the same run without load", times, "1");
    }
    const auto both = [](double a, double b) { return fixed(a, 0) + " / " + fixed(b, 0); };
    table_.add_row({type.name, both(times.wakeup.quantile_us(0.5), times.cyclictest.quantile_us(0.5)),
                    both(times.wakeup.quantile_us(0.99), times.cyclictest.quantile_us(0.99)),
                    both(wakeup, yardstick), fixed(wakeup / yardstick, 2), fixed(wakeup / idle, 2),
                    fixed(yardstick / idle_.cyclictest.quantile_us(0.999), 2),
                    fixed(times.compute.quantile_us(0.5), 1), fixed(times.compute.quantile_us(0.999), 1),
                    fixed(times.device.quantile_us(0.999), 1), std::to_string(times.periods_missed),
                    times.failed});
    const int colour = next_colour_++;
    if (type.kind == LoadKind::kNone || type.kind == LoadKind::kMachine || type.name == "64 subscribers") {
      const int of_pair = static_cast<int>(wakeup_.series.size()) / 2;
      wakeup_.series.push_back(curve(type.name, times.wakeup, of_pair, false));
      wakeup_.series.push_back(curve("cyclictest then", times.cyclictest, of_pair, true));
    }
    compute_.series.push_back(curve(type.name, times.compute, colour, colour >= 8));
    device_.series.push_back(curve(type.name, times.device, colour, colour >= 8));
  }

  void finish(const std::string& conditions) {
    report_.add_table("realtime_loop", "The loop's times under load", table_, conditions);
    report_.add_plot("realtime_wakeup", wakeup_);
    report_.add_plot("realtime_compute", compute_);
    report_.add_plot("realtime_device", device_);
  }

 private:
  void add_figure(const char* name, const LoadType& type, const char* source, double value,
                  std::optional<double> goal, std::optional<double> reference, const char* comes_from,
                  const LoopTimes& times, const char* unit = "us") {
    report_.add({.figure = name,
                 .conditions = {{"load", type.name}, {"source", source}},
                 .value = value,
                 .unit = unit,
                 .goal = goal,
                 .reference = reference,
                 .source = comes_from,
                 .failed = times.wakeup.count() > 0.0 ? "" : times.failed});
  }

  report::Report& report_;
  const LoopTimes& idle_;
  int next_colour_ = 0;
  report::MarkdownTable table_{{"load", "wake-up / cyclictest 50 % [µs]", "99 % [µs]", "99.9 % [µs]",
                                "99.9 % over cyclictest's", "99.9 % over idle", "cyclictest's over idle",
                                "compute 50 % [µs]", "compute 99.9 % [µs]", "device 99.9 % [µs]",
                                "periods missed", "failed"}};
  report::SvgPlot wakeup_ = empty_plot("Lateness of the wake-up (dashed: cyclictest beside it)", "lateness");
  report::SvgPlot compute_ = empty_plot("Computation of a tick", "time");
  report::SvgPlot device_ = empty_plot("Time in the drivers (simulated rig) per tick", "time");
};

}  // namespace

void measure_loop_under_load(report::Report& report, const RealtimeOptions& options) {
  const std::filesystem::path folder = report.folder() / "realtime";
  std::filesystem::create_directories(folder);
  const int rounds = options.quick ? 1 : options.rounds;
  const double seconds = options.quick ? 1.0 : options.seconds_per_turn;
  std::vector<LoadType> chosen;
  for (const LoadType& type : loads()) {
    if (!options.quick || type.in_quick) chosen.push_back(type);
  }

  DaemonProcess daemon(folder / "hapticd.log");
  client::Client client({.address = daemon.address()});
  v1::HandProgram taps;
  taps.set_kind(v1::HAND_PROGRAM_KIND_TAP);
  taps.set_repetitions(-1);
  client.set_hand_program(taps);
  std::string conditions =
      std::to_string(rounds) + " rounds of " + fixed(seconds, 0) +
      " s each, the loads by turns; hapticd and cyclictest side by side, both at 1 kHz, "
      "SCHED_FIFO 80. Scene tap_1d on the simulated rig in real time. 'Over idle' also says "
      "what the same load did to cyclictest, which shares nothing with hapticd. hapticd's quantiles are "
      "upper "
      "edges of bins that are 1/16 of a factor of two wide, so up to 6 % too high.";
  for (const std::string& shortcoming : client.rig_info().realtime_shortcomings())
    conditions += " Not granted: " + shortcoming + '.';

  std::map<std::string, LoopTimes> times;
  Twins twins;
  for (int round = 0; round < rounds; ++round) {
    for (const LoadType& type : chosen) {
      report::Report::note("round " + std::to_string(round + 1) + " of " + std::to_string(rounds) + ": " +
                           type.name);
      LoopTimes& of_load = times[type.name];
      try {
        measure_round(of_load, type, client, seconds, folder);
      } catch (const std::exception& error) {
        of_load.failed = error.what();
      }
    }
    measure_twins(twins, seconds, folder);
  }
  LoopReport loop_report(report, times.at(chosen.front().name));
  for (const LoadType& type : chosen) loop_report.add(type, times.at(type.name));
  loop_report.finish(conditions);
  add_twins(report, twins);
  daemon.stop();
}

}  // namespace hapticd::bench
