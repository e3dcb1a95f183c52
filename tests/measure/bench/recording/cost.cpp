#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "client/cpp/client.h"
#include "hal/recording/bytes.h"
#include "server/grpc/messages/telemetry_columns.h"
#include "server/recording/column_table.h"
#include "server/recording/export/table_export.h"
#include "server/recording/recording_output.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/live/processor_time.h"
#include "tests/measure/bench/realtime/quantile_ratio.h"
#include "tests/measure/bench/recording/parts.h"

namespace hapticd::bench {
namespace {

namespace fs = std::filesystem;
using client::Client;

constexpr std::chrono::seconds kCostTimeout{60};

double flight_recorder_share(const fs::path& folder, double rate_hz, double seconds) {
  DaemonProcess daemon(
      folder / "hapticd_flight.log",
      {.more_configuration = "[recording]\nfolder = \"" + (folder / "flight").string() + "\"\n",
       .rate_hz = rate_hz});
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const double before = processor_s(daemon.pid(), "flight");
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double share = (processor_s(daemon.pid(), "flight") - before) / seconds;
  daemon.stop();
  return share;
}

/// Turns without and with, one after the other, so that whatever else the machine does meets both.
struct Turns {
  double cpu_without = 0.0;
  double cpu_with = 0.0;
  std::vector<LatencyDistribution> without;
  std::vector<LatencyDistribution> with;
  double mb_per_s = 0.0;
};

Turns measure_turns(const fs::path& folder, double rate_hz, int loop_cpu, int rounds, double seconds) {
  const std::string name =
      "rate_" + std::to_string(static_cast<int>(rate_hz)) + "_cpu_" + std::to_string(loop_cpu);
  DaemonProcess daemon(folder / (name + ".log"),
                       {.scene = "tap_1d",
                        .loop_cpu = loop_cpu,
                        .more_configuration = "[recording]\nfolder = \"" + (folder / name).string() +
                                              "\"\nkeep_free_mb = 0.0\nflight_recorder = false\n",
                        .rate_hz = rate_hz});
  Client client({.address = daemon.address(), .timeout = kCostTimeout});
  v1::HandProgram press;
  press.set_kind(v1::HAND_PROGRAM_KIND_PRESS);
  press.set_force_n(3.0);
  press.set_hold_s(-1.0);
  client.set_hand_program(press);
  Turns turns;
  double total_s = 0.0;
  double total_mb = 0.0;
  for (int round = 0; round < 2 * rounds; ++round) {
    const bool records = round % 2 == 1;
    if (records) client.start_recording({});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const v1::LoopState before = client.rig_state().loop();
    const double cpu_before = processor_s(daemon.pid());
    const auto began = std::chrono::steady_clock::now();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const double cpu = processor_s(daemon.pid()) - cpu_before;
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const v1::LoopState after = client.rig_state().loop();
    (records ? turns.cpu_with : turns.cpu_without) += cpu / took_s / rounds;
    (records ? turns.with : turns.without).push_back(between(before.wakeup(), after.wakeup()));
    if (!records) continue;
    const v1::RecordingFile file = client.stop_recording();
    if (file.lost_ticks() > 0)
      throw std::runtime_error(std::to_string(file.lost_ticks()) + " ticks were lost");
    total_mb += 1e-6 * static_cast<double>(file.bytes());
    total_s += file.duration_s();
  }
  turns.mb_per_s = total_mb / total_s;
  daemon.stop();
  return turns;
}

/// What recording costs at this rate. loop_cpu: the loop's own CPU; -1: the loop runs where the others do.
void add_turns(const fs::path& folder, double rate_hz, int loop_cpu, bool quick, const AddFigure& add) {
  const bool is_pinned = loop_cpu >= 0;
  report::Case conditions{{"rate_hz", rate_hz}, {"loop_cpu", is_pinned ? "its own" : "any"}};
  report::Figure cpu{.figure = "recording_cpu_share",
                     .conditions = conditions,
                     .goal = 0.05,
                     .source = "of a core, all columns"};
  report::Figure size{.figure = "recording_mb_per_s", .conditions = conditions, .unit = "MB/s"};
  conditions.emplace_back("quantile", 0.999);
  report::Figure late{.figure = "recording_wakeup_ratio",
                      .conditions = conditions,
                      .goal = 1.1,
                      .source = "while recording over not recording, in turns"};
  std::string spread;
  try {
    const Turns turns = measure_turns(folder, rate_hz, loop_cpu, quick ? 3 : 30, 3.0);
    cpu.value = turns.cpu_with - turns.cpu_without;
    const QuantileRatio ratio = quantile_ratio(turns.with, turns.without, 0.999);
    late.value = ratio.value;
    spread = " (" + report::fixed(ratio.low, 2) + " … " + report::fixed(ratio.high, 2) + ")";
    size.value = turns.mb_per_s;
  } catch (const std::exception& error) {
    cpu.failed = late.failed = size.failed = error.what();
  }
  const std::string place = std::to_string(static_cast<int>(rate_hz)) + " Hz, loop on " +
                            (is_pinned ? "a CPU of its own" : "any CPU");
  add("recording_cpu_share, " + place, cpu);
  add("recording_wakeup_ratio, " + place + ", 99.9 %" + spread, late);
  add("recording_mb_per_s, " + place, size);
}

void add_rate(const fs::path& folder, double rate_hz, bool quick, const AddFigure& add) {
  for (const int loop_cpu : {-1, 0}) add_turns(folder, rate_hz, loop_cpu, quick, add);
  const std::string rate = std::to_string(static_cast<int>(rate_hz));
  report::Figure flight{.figure = "flight_recorder_cpu_share",
                        .conditions = {{"rate_hz", rate_hz}},
                        .source = "of a core, all columns"};
  try {
    flight.value = flight_recorder_share(folder, rate_hz, quick ? 3.0 : 20.0);
  } catch (const std::exception& error) {
    flight.failed = error.what();
  }
  add("flight_recorder_cpu_share, " + rate + " Hz", flight);
}

/// A recording of this length with all columns at 1 kHz, of numbers as they are measured: noise in the last
/// digits.
void write_long_recording(const fs::path& path, double hours) {
  server::RecordingSources sources;
  const server::ColumnTable table(server::telemetry_columns(), ~0U & ~rt::channel::kTruth);
  auto output =
      server::RecordingOutput::begin(path.string(), table.columns(), sources, {}, {{"name", "long"}});
  if (!output) throw std::runtime_error(output.error().text());
  rt::TickRecord record;
  record.channels = ~0U;
  std::uint64_t state = 1;
  const auto noise = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return 1e-11 * static_cast<double>(state >> 33U);
  };
  std::string rows;
  const auto ticks = static_cast<std::uint64_t>(hours * 3.6e6);
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    record.tick = tick;
    record.time_ns = static_cast<std::int64_t>(tick) * 1'000'000;
    const double phase = 1e-3 * static_cast<double>(tick);
    record.sensor_force_n = {noise(), noise(), std::sin(phase) + noise()};
    record.tip_position_mm = {0.03 * std::round(20.0 * std::sin(phase)), 0.0,
                              0.03 * std::round(100.0 * phase)};
    record.reaction_force_n = std::sin(phase) + noise();
    record.displacement_mm = std::abs(std::sin(phase)) + noise();
    record.commanded_force_n = 0.3 * record.reaction_force_n;
    record.hand_force_n = record.reaction_force_n - record.commanded_force_n;
    record.timing.compute_ns = 3000 + static_cast<std::int64_t>(state >> 55U);
    table.append_row(record, rows);
    if (tick % 500 != 499) continue;
    output->add_rows(rows);
    rows.clear();
    if (const auto error = output->close_chunk()) throw std::runtime_error(error->text());
  }
  if (const auto error = output->finish({})) throw std::runtime_error(error->text());
}

void add_export(const fs::path& folder, bool quick, const AddFigure& add) {
  const double hours = quick ? 0.1 : 1.0;
  const fs::path path = folder / "long.mcap";
  std::string failed;
  try {
    write_long_recording(path, hours);
  } catch (const std::exception& error) {
    failed = error.what();
  }
  for (const bool is_csv : {false, true}) {
    report::Figure figure{.figure = "recording_export_s",
                          .conditions = {{"format", is_csv ? "csv" : "hdf5"}, {"hours", hours}},
                          .unit = "s",
                          .goal = is_csv ? std::nullopt : std::optional(20.0 * hours),
                          .source = "all columns, 1 kHz",
                          .failed = failed};
    if (failed.empty()) {
      server::ExportRequest request;
      request.input = path.string();
      request.output = (folder / (is_csv ? "long.csv" : "long.h5")).string();
      request.format = is_csv ? server::TableFormat::kCsv : server::TableFormat::kHdf5;
      const auto began = std::chrono::steady_clock::now();
      if (const auto error = server::export_table(request)) figure.failed = error->text();
      figure.value = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
      fs::remove(request.output);
    }
    add("recording_export_s, " + report::fixed(hours, 1) + " h as " + (is_csv ? "CSV" : "HDF5"), figure);
  }
  fs::remove(path);
}

}  // namespace

void add_cost_figures(const fs::path& folder, bool quick, const AddFigure& add) {
  for (const double rate_hz : {1000.0, 5000.0}) add_rate(folder, rate_hz, quick, add);
  add_export(folder, quick, add);
}

}  // namespace hapticd::bench
