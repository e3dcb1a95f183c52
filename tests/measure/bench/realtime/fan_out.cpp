#include "tests/measure/bench/realtime/fan_out.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/live/processor_time.h"
#include "tests/measure/bench/live/subscriber.h"

namespace hapticd::bench {
namespace {

using report::fixed;

constexpr int kGoalSubscribers = 64;
constexpr int kStreamsPerProcess = 8;
/// A subscriber further behind than this does not keep up; its queue only has not run over yet.
constexpr double kKeepsUpMs = 500.0;

struct FanOut {
  SubscriberTally tally;
  double daemon_cpu_s = 0.0;
};

struct Subscribers {
  int count = 0;
  bool blocks = false;
  double rate_hz = 1000.0;
};

FanOut run(const Subscribers& subscribers, double seconds, const std::filesystem::path& folder) {
  FanOut result;
  DaemonProcess daemon(folder / "hapticd_fan_out.log", {.rate_hz = subscribers.rate_hz});
  const double before_s = processor_s(daemon.pid());
  std::vector<std::unique_ptr<SubscriberProcess>> readers;
  for (int left = subscribers.count; left > 0; left -= kStreamsPerProcess) {
    readers.push_back(std::make_unique<SubscriberProcess>(
        daemon.address(), seconds, folder / ("reader_" + std::to_string(left) + ".json"),
        std::min(left, kStreamsPerProcess), subscribers.blocks));
  }
  for (const auto& reader : readers) result.tally += reader->finish();
  if (readers.empty()) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  result.daemon_cpu_s = processor_s(daemon.pid()) - before_s;
  return result;
}

/// Measures the fan-out of blocks, where 64 take 1 kHz and 8 take 10 kHz, whole.
void measure_block_fan_out(report::Report& report, double seconds, bool quick,
                           const std::filesystem::path& folder) {
  report::MarkdownTable table({"rate [Hz]", "subscribers", "samples", "missing or dropped",
                               "furthest behind [ms]", "kB/s per subscriber", "daemon [% of a core]",
                               "per subscriber [% of a core]", "failed"});
  for (const Subscribers& subscribers :
       {Subscribers{quick ? 8 : 64, true, 1000.0}, Subscribers{quick ? 2 : 8, true, 10'000.0}}) {
    report::Report::note(std::to_string(subscribers.count) + " subscribers of blocks at " +
                         fixed(subscribers.rate_hz, 0) + " Hz");
    const report::Case conditions{{"subscribers", subscribers.count}, {"rate_hz", subscribers.rate_hz}};
    report::Figure lost{.figure = "block_samples_lost", .conditions = conditions, .goal = 0.0};
    report::Figure cpu{.figure = "block_subscriber_cpu_share", .conditions = conditions};
    std::vector<std::string> row{fixed(subscribers.rate_hz, 0), std::to_string(subscribers.count)};
    try {
      const double alone_s = run({0, true, subscribers.rate_hz}, seconds, folder).daemon_cpu_s;
      const FanOut result = run(subscribers, seconds, folder);
      const SubscriberTally& t = result.tally;
      lost.value =
          static_cast<double>(t.missing + t.disordered + t.dropped_by_subscriber + t.dropped_by_server);
      cpu.value = (result.daemon_cpu_s - alone_s) / seconds / subscribers.count;
      row.insert(row.end(),
                 {std::to_string(t.samples), fixed(*lost.value, 0), fixed(t.behind_ms, 0),
                  fixed(1e-3 * static_cast<double>(t.bytes) / subscribers.count / seconds, 0),
                  fixed(100.0 * result.daemon_cpu_s / seconds, 1), fixed(100.0 * *cpu.value, 2), ""});
    } catch (const std::exception& error) {
      lost.failed = cpu.failed = error.what();
      row.insert(row.end(), {"", "", "", "", "", "", error.what()});
    }
    report.add(lost);
    report.add(cpu);
    table.add_row(row);
  }
  report.add_table("realtime_block_fan_out", "Telemetry blocks", table,
                   "All columns of every tick, " + fixed(seconds, 0) +
                       " s each, as in the table before; a subscriber's processor time is the daemon's.");
}

}  // namespace

void measure_fan_out(report::Report& report, const RealtimeOptions& options) {
  const std::filesystem::path folder = report.folder() / "realtime";
  std::filesystem::create_directories(folder);
  const double seconds = options.quick ? 1.5 : 6.0;
  const std::vector<int> counts =
      options.quick ? std::vector<int>{0, 8} : std::vector<int>{0, 1, 8, 32, 64, 96, 128, 192, 256};

  report::MarkdownTable table({"subscribers", "samples", "per subscriber and s", "missing or dropped",
                               "furthest behind [ms]", "kB/s per subscriber", "daemon [% of a core]",
                               "per subscriber [% of a core]", "failed"});
  report::PlotSeries cpu;
  cpu.name = "daemon";
  cpu.mark = report::PlotMark::kOfColor;
  std::optional<int> without_loss;
  double alone_share = 0.0;
  for (const int count : counts) {
    report::Report::note(std::to_string(count) + " subscribers");
    try {
      const FanOut result = run({.count = count}, seconds, folder);
      const double share = result.daemon_cpu_s / seconds;
      if (count == 0) alone_share = share;
      const double n = std::max(1, count);
      const SubscriberTally& t = result.tally;
      table.add_row({std::to_string(count), std::to_string(t.samples),
                     fixed(static_cast<double>(t.samples) / n / seconds, 0),
                     std::to_string(t.missing + t.dropped_by_subscriber + t.dropped_by_server),
                     fixed(t.behind_ms, 0), fixed(1e-3 * static_cast<double>(t.bytes) / n / seconds, 0),
                     fixed(100.0 * share, 1),
                     count > 0 ? fixed(100.0 * (share - alone_share) / n, 2) : report::kNoNumber, ""});
      cpu.add(count, 100.0 * share);
      if (count == 0) continue;
      report.add({.figure = "subscriber_bytes_per_s",
                  .conditions = {{"subscribers", count}},
                  .value = static_cast<double>(t.bytes) / n / seconds,
                  .unit = "B/s"});
      report.add({.figure = "subscriber_cpu_share",
                  .conditions = {{"subscribers", count}},
                  .value = (share - alone_share) / n});
      if (!t.complete() || t.behind_ms > kKeepsUpMs) break;
      without_loss = count;
    } catch (const std::exception& error) {
      table.add_row({std::to_string(count), "", "", "", "", "", "", "", error.what()});
      break;
    }
  }
  report::Figure figure{.figure = "subscribers_without_loss",
                        .conditions = {{"rate_hz", 1000}},
                        .goal = kGoalSubscribers,
                        .source = "64 on two cores"};
  if (without_loss) {
    figure.value = *without_loss;
  } else {
    figure.failed = "not one got every sample";
  }
  report.add(figure);
  report.add_table(
      "realtime_fan_out", "Telemetry fan-out until the first loss", table,
      "All groups at 1 kHz, " + fixed(seconds, 0) +
          " s each; readers in processes of eight, each stream with its own connection, on the same "
          "cores as the daemon. Processor time of the daemon, loop and simulated physics included; per "
          "subscriber what is more than without any. The last row is the first with a loss, or with one that "
          "falls "
          "more than half a second behind.");
  measure_block_fan_out(report, seconds, options.quick, folder);
  report::Plot plot;
  plot.title = "Processor time of the daemon against subscribers";
  plot.x = {"subscribers at 1 kHz"};
  plot.y = {"processor time of the daemon", "% of a core"};
  plot.y.minimum = 0.0;
  plot.series = {cpu};
  report.add_plot("realtime_fan_out", plot, {.height_px = 360});
}

}  // namespace hapticd::bench
