#include "tests/measure/bench/realtime/loop_under_load.h"

#include <sched.h>

#include <chrono>
#include <exception>
#include <map>
#include <stdexcept>
#include <thread>

#include "client/cpp/client.h"
#include "rt/loop/loop_cpu.h"
#include "tests/measure/bench/live/cyclictest.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/realtime/load.h"
#include "tests/measure/bench/realtime/quantile_ratio.h"

namespace hapticd::bench {
namespace {

using report::fixed;
using report::kNoNumber;

constexpr double kGoalOverCyclictest = 1.1;
constexpr double kGoalOverIdle = 1.1;
constexpr double kTail = 0.999;
constexpr double kPeriodUs = 1000.0;

using Rounds = std::vector<LatencyDistribution>;

/// What one load did to the loop, round by round.
struct LoopTimes {
  Rounds tick;   ///< how late ticks began
  Rounds timer;  ///< how late the kernel woke the thread
  Rounds jitter;
  Rounds compute;
  Rounds device;
  Rounds cyclictest;
  std::uint64_t periods_missed = 0;
  std::string failed;  ///< why there is nothing, or nothing to compare with
};

// The loop is due half a millisecond after full ones, as shipped it is woken 50 µs before. Its yardstick is
// woken 150 µs earlier, and done by then: two that are woken within some 50 µs wait for each other.
constexpr int kLoopWokenAfterUs = 450;
constexpr int kYardstickWokenAfterUs = 300;

/// Both on one CPU, which belongs to nothing else of ours, and soon after each other, so that what the
/// machine does to the one it does to the other. The yardstick has the higher priority: the loop may delay it
/// never.
struct Placement {
  int loop_cpu = -1;
  CyclictestPlace yardstick{.priority = 81, .after_us = kYardstickWokenAfterUs};
};

/// Takes the last of the CPUs this process may use; from then on all but that one are for this process and
/// whatever it starts. On a machine with one CPU everything shares it.
Placement take_a_cpu_for_the_loop() {
  cpu_set_t cpus;
  if (sched_getaffinity(0, sizeof cpus, &cpus) != 0 || CPU_COUNT(&cpus) < 2) return {};
  Placement placement;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) placement.loop_cpu = cpu;
  }
  placement.yardstick.cpu = placement.loop_cpu;
  if (const std::string why = rt::leave_to_the_loop(placement.loop_cpu); !why.empty())
    throw std::runtime_error("this program cannot keep off the loop's CPU: " + why);
  return placement;
}

using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC

/// Time at which an aligned cyclictest that is started now begins to measure; waits for a moment at which
/// that is clear.
Clock::time_point full_second_to_come() {
  using namespace std::chrono_literals;
  const auto second = std::chrono::floor<std::chrono::seconds>(Clock::now()) + 1s;
  if (second - Clock::now() > 500ms) return second;
  std::this_thread::sleep_until(second);
  return second + 1s;
}

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// What a load needs to be there, and how much longer than what is measured it lasts, so that it is there
/// from the first to the last tick.
constexpr double kSettleS = 0.5;
constexpr double kStartS = 3.0;

void measure_round(LoopTimes& times, const LoadType& type, client::Client& client, double seconds,
                   const std::filesystem::path& folder, const Placement& placement) {
  const auto load = type.start(client.address(), seconds + kStartS, folder);
  sleep_s(kSettleS);
  const Clock::time_point begin = full_second_to_come();
  Cyclictest cyclictest(seconds, folder / "cyclictest.txt", placement.yardstick);
  std::this_thread::sleep_until(begin);
  const v1::LoopState before = client.rig_state().loop();
  std::this_thread::sleep_until(
      begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
  const v1::LoopState after = client.rig_state().loop();
  const Cyclictest::Outcome yardstick = cyclictest.finish();
  times.tick.push_back(between(before.wakeup(), after.wakeup()));
  times.timer.push_back(between(before.timer(), after.timer()));
  times.jitter.push_back(between(before.jitter(), after.jitter()));
  times.compute.push_back(between(before.compute(), after.compute()));
  times.device.push_back(between(before.device(), after.device()));
  times.cyclictest.push_back(yardstick.wakeup.value_or(LatencyDistribution{}));
  times.periods_missed += after.periods_missed() - before.periods_missed();
  if (!yardstick.wakeup) times.failed = yardstick.failed;
}

/// Two of the same on one CPU: what two that differ in nothing differ by on this machine.
struct Twins {
  Rounds a;
  Rounds b;
  std::string failed;
};

void measure_twins(Twins& twins, double seconds, const std::filesystem::path& folder,
                   const Placement& placement) {
  Cyclictest first(seconds, folder / "cyclictest_a.txt",
                   {.cpu = placement.yardstick.cpu, .after_us = kLoopWokenAfterUs});
  Cyclictest second(seconds, folder / "cyclictest_b.txt", placement.yardstick);
  const Cyclictest::Outcome a = first.finish();
  const Cyclictest::Outcome b = second.finish();
  twins.a.push_back(a.wakeup.value_or(LatencyDistribution{}));
  twins.b.push_back(b.wakeup.value_or(LatencyDistribution{}));
  if (!a.wakeup) twins.failed = a.failed;
}

std::string text_of(const QuantileRatio& ratio) {
  const std::string value = fixed(ratio.value, 2);
  if (ratio.low == ratio.high) return value;
  return value + " (" + fixed(ratio.low, 2) + " … " + fixed(ratio.high, 2) + ")";
}

void add_twins(report::Report& report, const Twins& twins) {
  const QuantileRatio ratio = quantile_ratio(twins.a, twins.b, kTail);
  report.add({.figure = "wakeup_p999_of_twins",
              .conditions = {{"source", "cyclictest next to cyclictest"}},
              .value = ratio.value,
              .unit = "1",
              .source = "priority 80 over priority 81, same CPU",
              .failed = twins.failed});
  const LatencyDistribution a = sum_of(twins.a);
  const LatencyDistribution b = sum_of(twins.b);
  report.say(
      "Two cyclictests on that CPU instead, as often and as long, the first with the loop's priority: 99 % "
      "at " +
      fixed(a.quantile_us(0.99), 0) + " and " + fixed(b.quantile_us(0.99), 0) + " µs, 99.9 % at " +
      fixed(a.quantile_us(kTail), 0) + " and " + fixed(b.quantile_us(kTail), 0) + " µs, ratio " +
      text_of(ratio) + ". Differences smaller than that are not resolved on this machine.");
}

report::PlotSeries curve(const std::string& label, const LatencyDistribution& distribution, int colour,
                         bool dashed) {
  report::PlotSeries series;
  series.name = label;
  series.color = cli::palette(static_cast<std::size_t>(colour));
  if (dashed) series.line = report::PlotLine::kDashed;
  const std::vector<double> beyond = distribution.beyond();
  for (std::size_t i = 0; i < beyond.size(); ++i) {
    if (beyond[i] <= 0.0) continue;  // the last bin; there is no zero on a logarithmic axis
    series.add(distribution.bins[i].up_to_us, beyond[i]);
  }
  return series;
}

report::Plot empty_plot(const std::string& title, const std::string& what) {
  report::Plot plot;
  plot.title = title;
  plot.x = {what, "µs", true};
  plot.y = {"share of ticks that took longer", "", true};
  return plot;
}

class LoopReport {
 public:
  LoopReport(report::Report& report, const LoopTimes& idle) : report_(report), idle_(idle) {}

  void add(const LoadType& type, const LoopTimes& times) {
    const LatencyDistribution tick = sum_of(times.tick);
    const LatencyDistribution timer = sum_of(times.timer);
    const LatencyDistribution jitter = sum_of(times.jitter);
    const LatencyDistribution compute = sum_of(times.compute);
    const LatencyDistribution device = sum_of(times.device);
    const LatencyDistribution cyclictest = sum_of(times.cyclictest);
    const double yardstick = cyclictest.quantile_us(kTail);
    add_figure("wakeup_p999_us", type, "hapticd", tick.quantile_us(kTail), kGoalOverCyclictest * yardstick,
               yardstick, "cyclictest on the same CPU in the same seconds", times);
    add_figure("wakeup_p999_us", type, "hapticd's timer alone", timer.quantile_us(kTail), {}, yardstick,
               "cyclictest on the same CPU in the same seconds", times);
    add_figure("wakeup_p999_us", type, "cyclictest", yardstick, {}, {}, "", times);
    add_figure("jitter_p999_us", type, "hapticd", jitter.quantile_us(kTail), {}, {}, "", times);
    add_figure("compute_p999_us", type, "hapticd", compute.quantile_us(kTail), {}, {}, "", times);
    add_figure("device_p999_us", type, "hapticd", device.quantile_us(kTail), {}, {}, "", times);
    const QuantileRatio over_idle = quantile_ratio(times.tick, idle_.tick, kTail);
    const QuantileRatio yardstick_over_idle = quantile_ratio(times.cyclictest, idle_.cyclictest, kTail);
    const double period_over_idle =
        (kPeriodUs + jitter.quantile_us(kTail)) / (kPeriodUs + sum_of(idle_.jitter).quantile_us(kTail));
    if (type.kind == LoadKind::kService) {
      const char* source = "the same rounds without load";
      add_figure("wakeup_p999_over_idle", type, "hapticd", over_idle.value, kGoalOverIdle, {}, source, times,
                 "1");
      add_figure("wakeup_p999_over_idle", type, "cyclictest", yardstick_over_idle.value, {}, {}, source,
                 times, "1");
      add_figure("period_p999_over_idle", type, "hapticd", period_over_idle, kGoalOverIdle, {}, source, times,
                 "1");
    }
    const auto three = [&](double share, int digits) {
      return fixed(tick.quantile_us(share), digits) + " / " + fixed(timer.quantile_us(share), digits) +
             " / " + fixed(cyclictest.quantile_us(share), digits);
    };
    wakeups_.add_row({type.name, three(0.5, 1), three(0.99, 0), three(kTail, 0),
                      text_of(quantile_ratio(times.tick, times.cyclictest, kTail)),
                      text_of(quantile_ratio(times.timer, times.cyclictest, kTail)), text_of(over_idle),
                      text_of(yardstick_over_idle), times.failed});
    ticks_.add_row({type.name, fixed(compute.quantile_us(0.5), 1), fixed(compute.quantile_us(kTail), 1),
                    fixed(device.quantile_us(0.5), 1), fixed(device.quantile_us(kTail), 1),
                    fixed(jitter.quantile_us(0.5), 2), fixed(jitter.quantile_us(0.99), 1),
                    fixed(jitter.quantile_us(kTail), 0), fixed(period_over_idle, 2),
                    std::to_string(times.periods_missed) + " of " + fixed(tick.count(), 0)});
    const int colour = next_colour_++;
    if (type.kind == LoadKind::kNone || type.kind == LoadKind::kMachine || type.name == "64 subscribers") {
      const int of_pair = static_cast<int>(wakeup_.series.size()) / 2;
      wakeup_.series.push_back(curve(type.name, tick, of_pair, false));
      wakeup_.series.push_back(curve("cyclictest then", cyclictest, of_pair, true));
    }
    compute_.series.push_back(curve(type.name, compute, colour, colour >= 8));
    device_.series.push_back(curve(type.name, device, colour, colour >= 8));
  }

  void finish(const std::string& conditions) {
    report_.add_table("realtime_loop", "The loop's wake-up under load", wakeups_, conditions);
    report_.add_table(
        "realtime_tick", "The loop's other times in the same rounds", ticks_,
        "Jitter: by how much the time from tick to tick differed from a period. A period is missed when "
        "the machine was at rest longer than it, or the tick took longer.");
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
                 .failed = times.tick.empty() ? times.failed : ""});
  }

  report::Report& report_;
  const LoopTimes& idle_;
  int next_colour_ = 0;
  report::MarkdownTable wakeups_{{"load", "late by 50 %: tick / timer / cyclictest [µs]", "99 % [µs]",
                                  "99.9 % [µs]", "99.9 %, tick over cyclictest", "timer over cyclictest",
                                  "tick over idle", "cyclictest over idle", "failed"}};
  report::MarkdownTable ticks_{{"load", "compute 50 % [µs]", "99.9 % [µs]", "device 50 % [µs]", "99.9 % [µs]",
                                "jitter 50 % [µs]", "99 % [µs]", "99.9 % [µs]",
                                "99.9 % of the period over idle", "periods missed"}};
  report::Plot wakeup_ = empty_plot("Lateness of a tick (dashed: cyclictest next to it)", "lateness");
  report::Plot compute_ = empty_plot("Computation of a tick", "time");
  report::Plot device_ = empty_plot("Time in the drivers (simulated rig) per tick", "time");
};

std::string conditions_of(int rounds, double seconds, const Placement& placement, client::Client& client) {
  std::string text = std::to_string(rounds) + " rounds of " + fixed(seconds, 0) +
                     " s each, the loads by turns; hapticd and cyclictest side by side, both at 1 kHz. ";
  text += placement.loop_cpu >= 0
              ? "Both on CPU " + std::to_string(placement.loop_cpu) +
                    ", which no other thread of hapticd and none of the clients uses (stress-ng does). "
              : "All on the only CPU. ";
  text +=
      "SCHED_FIFO 80, cyclictest 81 and woken 150 µs before the loop, so that it is never kept waiting and "
      "what the "
      "machine does to the one it does to the other. Scene tap_1d on the simulated rig in real time. Tick: "
      "how late a "
      "tick began; hapticd has itself woken 50 µs early and waits awake. Timer: how late it was woken, which "
      "is what "
      "cyclictest measures, too. In brackets 5 … 95 % of a bootstrap over rounds.";
  for (const std::string& shortcoming : client.rig_info().realtime_shortcomings())
    text += " Not granted: " + shortcoming + '.';
  return text;
}

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

  const Placement placement = take_a_cpu_for_the_loop();
  DaemonProcess daemon(folder / "hapticd.log", {.loop_cpu = placement.loop_cpu});
  client::Client client({.address = daemon.address()});
  v1::HandProgram taps;
  taps.set_kind(v1::HAND_PROGRAM_KIND_TAP);
  taps.set_repetitions(-1);
  client.set_hand_program(taps);

  std::map<std::string, LoopTimes> times;
  Twins twins;
  for (int round = 0; round < rounds; ++round) {
    for (const LoadType& type : chosen) {
      report::Report::note("round " + std::to_string(round + 1) + " of " + std::to_string(rounds) + ": " +
                           type.name);
      LoopTimes& of_load = times[type.name];
      try {
        measure_round(of_load, type, client, seconds, folder, placement);
      } catch (const std::exception& error) {
        of_load.failed = error.what();
      }
    }
    measure_twins(twins, seconds, folder, placement);
  }
  LoopReport loop_report(report, times.at(chosen.front().name));
  for (const LoadType& type : chosen) loop_report.add(type, times.at(type.name));
  loop_report.finish(conditions_of(rounds, seconds, placement, client));
  add_twins(report, twins);
  daemon.stop();
}

}  // namespace hapticd::bench
