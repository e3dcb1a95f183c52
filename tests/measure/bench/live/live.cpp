#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/cyclictest.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/live/subscriber.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

using report::fixed;
using report::kNoNumber;

/// One run of the daemon.
struct LiveCase {
  int subscribers = 0;
  bool disturbed = false;  ///< a further subscriber stalls, and another is killed

  std::string name() const { return std::to_string(subscribers) + (disturbed ? "_disturbed" : ""); }
  std::string disturbance() const { return disturbed ? "one stalled, one killed" : "none"; }
  report::Case conditions() const {
    report::Case conditions{{"subscribers", subscribers}};
    if (disturbed) conditions.emplace_back("disturbance", "stalled_and_killed");
    return conditions;
  }
  report::Case conditions(const char* source) const {
    report::Case all = conditions();
    all.emplace(all.begin(), "source", source);
    return all;
  }
};

struct LiveResult {
  SubscriberTally telemetry;  ///< of all subscribers that were left in peace
  v1::LoopState loop;
  Cyclictest::Outcome cyclictest;
  std::vector<std::string> shortcomings;
  int daemon_status = -1;
};

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// Taps for ever, so that what is sent is alive.
void start_tapping(client::Client& client) {
  v1::HandProgram taps;
  taps.set_kind(v1::HAND_PROGRAM_KIND_TAP);
  taps.set_repetitions(-1);
  client.set_hand_program(taps);
}

LiveResult run_case(const LiveCase& live, double seconds, const std::filesystem::path& folder) {
  LiveResult result;
  DaemonProcess daemon(folder / ("hapticd_" + live.name() + ".log"));
  client::Client client({.address = daemon.address()});
  start_tapping(client);
  const v1::RigInfo rig = client.rig_info();
  result.shortcomings.assign(rig.realtime_shortcomings().begin(), rig.realtime_shortcomings().end());

  Cyclictest cyclictest(seconds, folder / ("cyclictest_" + live.name() + ".txt"));
  std::vector<std::unique_ptr<SubscriberProcess>> subscribers;
  const auto subscribe = [&](const std::string& name) {
    return std::make_unique<SubscriberProcess>(daemon.address(), seconds,
                                               folder / ("subscriber_" + name + ".json"));
  };
  subscribers.reserve(static_cast<std::size_t>(live.subscribers));
  for (int i = 0; i < live.subscribers; ++i) subscribers.push_back(subscribe(std::to_string(i)));
  if (live.disturbed) {
    const auto stalled = subscribe("stalled");
    const auto killed = subscribe("killed");
    sleep_s(seconds / 4);
    stalled->stall();
    sleep_s(seconds / 4);
    killed->kill();
    for (const auto& subscriber : subscribers) result.telemetry += subscriber->finish();
    result.cyclictest = cyclictest.finish();
  } else {
    for (const auto& subscriber : subscribers) result.telemetry += subscriber->finish();
    result.cyclictest = cyclictest.finish();
    if (!result.cyclictest.wakeup && subscribers.empty()) sleep_s(seconds);  // nothing else measured the time
  }
  result.loop = client.rig_state().loop();
  result.daemon_status = daemon.stop();
  return result;
}

/// The figures and table rows of one run.
class LiveReport {
 public:
  explicit LiveReport(report::Report& report) : report_(report) {}

  void add(const LiveCase& live, const LiveResult& result) {
    add_wakeup(live, "hapticd", between({}, result.loop.wakeup()),
               std::to_string(result.loop.periods_missed()), "", result.cyclictest.wakeup);
    add_wakeup(live, "cyclictest", result.cyclictest.wakeup, kNoNumber, result.cyclictest.failed);
    if (result.daemon_status != 0) {
      report::Report::note("hapticd ended with status " + std::to_string(result.daemon_status));
    }
    if (live.subscribers == 0) return;

    const SubscriberTally& t = result.telemetry;
    add_telemetry(live, static_cast<double>(t.gaps + t.disordered),
                  static_cast<double>(t.dropped_by_subscriber + t.dropped_by_server), "");
    telemetry_.add_row({std::to_string(live.subscribers), live.disturbance(), std::to_string(t.samples),
                        std::to_string(t.gaps), std::to_string(t.missing), std::to_string(t.disordered),
                        std::to_string(t.dropped_by_subscriber), std::to_string(t.dropped_by_server)});
  }

  void add_failure(const LiveCase& live, const std::string& why) {
    report::Report::note(live.name() + " subscribers: " + why);
    for (const char* source : {"hapticd", "cyclictest"})
      add_wakeup(live, source, std::nullopt, kNoNumber, why);
    if (live.subscribers > 0) add_telemetry(live, std::nullopt, std::nullopt, why);
  }

  void add_tables(const std::string& conditions) {
    report_.add_table("live_wakeup", "Lateness of the wake-up, in the same minute on the same machine",
                      wakeup_,
                      conditions +
                          "Both at 1 kHz, SCHED_FIFO 80, side by side. A loop that comes late skips the "
                          "periods it missed;\n"
                          "cyclictest does not count the cycles it catches up.");
    report_.add_table("live_telemetry", "Telemetry at the full rate", telemetry_,
                      "Sums over all subscribers that were neither stalled nor killed. A gap is a place "
                      "where the sequence of\n"
                      "ticks is broken; dropped is what the stream itself reported.");
  }

 private:
  /// `reference`: what another measured in the same run.
  void add_wakeup(const LiveCase& live, const char* source, const std::optional<LatencyDistribution>& wakeup,
                  const std::string& periods_missed, const std::string& failed,
                  const std::optional<LatencyDistribution>& reference = std::nullopt) {
    report::Figure p99{
        .figure = "wakeup_p99_us", .conditions = live.conditions(source), .unit = "us", .failed = failed};
    report::Figure p999{
        .figure = "wakeup_p999_us", .conditions = live.conditions(source), .unit = "us", .failed = failed};
    if (wakeup) {
      p99.value = wakeup->quantile_us(0.99);
      p999.value = wakeup->quantile_us(0.999);
    }
    if (reference) {
      p99.reference = reference->quantile_us(0.99);
      p999.reference = reference->quantile_us(0.999);
      p99.source = p999.source = "cyclictest in the same run";
    }
    report_.add(p99);
    report_.add(p999);
    const auto cell = [&wakeup](double share) {
      return wakeup ? fixed(wakeup->quantile_us(share), 1) : std::string(kNoNumber);
    };
    wakeup_.add_row({std::to_string(live.subscribers), live.disturbance(), source, cell(0.5), cell(0.99),
                     cell(0.999), cell(1.0), periods_missed, failed});
  }

  void add_telemetry(const LiveCase& live, std::optional<double> gaps, std::optional<double> dropped,
                     const std::string& failed) {
    report_.add({.figure = "telemetry_gaps",
                 .conditions = live.conditions(),
                 .value = gaps,
                 .goal = 0.0,
                 .failed = failed});
    report_.add({.figure = "telemetry_dropped",
                 .conditions = live.conditions(),
                 .value = dropped,
                 .goal = 0.0,
                 .failed = failed});
  }

  report::Report& report_;
  report::MarkdownTable wakeup_{{"subscribers", "disturbance", "source", "median [µs]", "99 % [µs]",
                                 "99.9 % [µs]", "max [µs]", "periods missed", "failed"}};
  report::MarkdownTable telemetry_{{"subscribers", "disturbance", "samples", "gaps", "missing", "disordered",
                                    "dropped by subscriber", "dropped by server"}};
};

}  // namespace

int run_live(const LiveOptions& options) {
  report::Report report(options.folder);
  const std::filesystem::path logs = report.folder() / "live";
  std::filesystem::create_directories(logs);

  std::vector<LiveCase> cases;
  for (const int subscribers : options.subscribers) cases.push_back({subscribers, false});
  cases.push_back({*std::max_element(options.subscribers.begin(), options.subscribers.end()), true});

  LiveReport live_report(report);
  std::string conditions;
  for (const LiveCase& live : cases) {
    report::Report::note(live.name() + " subscribers, " + fixed(options.seconds, 0) + " s …");
    try {
      const LiveResult result = run_case(live, options.seconds, logs);
      live_report.add(live, result);
      conditions.clear();
      for (const std::string& shortcoming : result.shortcomings)
        conditions += "Not granted: " + shortcoming + ".\n";
    } catch (const std::exception& error) {
      live_report.add_failure(live, error.what());
    }
  }
  live_report.add_tables(conditions);
  return 0;
}

int run_live_child(const std::string& address, double seconds, const std::string& result, int streams,
                   bool blocks) {
  return run_subscriber(address, seconds, result, streams, blocks);
}

}  // namespace hapticd::bench
