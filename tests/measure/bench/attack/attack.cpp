#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/attack/rows.h"
#include "tests/measure/bench/attack/stop_under_attack.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/report.h"
#include "tests/support/process_memory.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using report::fixed;

constexpr std::chrono::seconds kTimeout{60};

double seconds_since(Clock::time_point began) {
  return std::chrono::duration<double>(Clock::now() - began).count();
}

/// Sends a recording until the daemon has it; the megabytes a second of the sending.
double upload(client::Client& client, std::uint64_t bytes) {
  v1::RecordingDescription description;
  description.set_name("bench.csv");
  Rows rows(bytes, Rows::Length::kLong);
  client::RecordingUpload upload = client.upload_recording(description);
  const auto began = Clock::now();
  for (std::string piece = rows.next_piece(); !piece.empty(); piece = rows.next_piece()) {
    upload.send(std::move(piece));
    if (!upload.taken(kTimeout)) throw std::runtime_error("the daemon does not take the recording");
  }
  const double sending_s = seconds_since(began);
  upload.finish();
  if (!upload.answer(kTimeout)) throw std::runtime_error("the daemon does not answer the upload");
  return 1e-6 * static_cast<double>(bytes) / sending_s;
}

struct Flood {
  const char* name;
  /// Returns how many calls, connections or streams it tried. `scale`: 1 in full, less for a quick look.
  long (*run)(const std::string& address, double scale);
};

long large_texts(const std::string& address, double scale) {
  client::Client client({.address = address});
  const int texts = static_cast<int>(60 * scale);
  for (int i = 0; i < texts; ++i) {
    std::string toml = "name = \"" + std::string(10'000, 'x') + std::to_string(i) + "\"\n";
    while (toml.size() < 900'000) toml += "key_" + std::to_string(toml.size()) + " = 1\n";
    try {
      client.load_scene({.toml = toml});
    } catch (const client::Error&) {
      // Refused, as it should be.
    }
  }
  return texts;
}

long subscribers_that_never_read(const std::string& address, double scale) {
  client::Client client({.address = address});
  v1::SubscribeRequest request;
  request.set_batch_size(1);
  request.set_queue_samples(4'000);
  std::vector<client::TelemetryStream> streams;
  for (int i = 0; i < static_cast<int>(80 * scale); ++i) streams.push_back(client.subscribe(request));
  std::this_thread::sleep_for(std::chrono::duration<double>(5.0 * scale));
  return static_cast<long>(streams.size());
}

long unfinished_uploads(const std::string& address, double scale) {
  client::Client client({.address = address});
  const int uploads = static_cast<int>(100 * scale);
  for (int i = 0; i < uploads; ++i) {
    client::RecordingUpload upload = client.upload_recording({});
    Rows rows(1'000'000, Rows::Length::kLong);
    upload.send(rows.next_piece());
    try {
      upload.taken(std::chrono::milliseconds(200));
    } catch (const client::Error&) {
      // Others are still under way.
    }
  }
  return uploads;
}

/// Calls as fast as it goes for so long, by several clients at once; refusals count as well.
template <class Call>
long storm(const std::string& address, double seconds, Call&& call) {
  constexpr int kClients = 8;
  std::atomic<long> tried{0};
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  std::vector<std::thread> threads;
  for (int i = 0; i < kClients; ++i) {
    threads.emplace_back([&] {
      client::Client client({.address = address});
      while (Clock::now() < end) {
        try {
          call(client);
        } catch (const client::Error&) {
          // Refused, or too many.
        }
        tried.fetch_add(1, std::memory_order_relaxed);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return tried;
}

long leases_and_takes(const std::string& address, double scale) {
  return storm(address, 5.0 * scale, [](client::Client& client) {
    v1::TakeLeaseRequest take;
    take.set_reason("storm");
    client.take_lease(take);
    client.return_lease();
  });
}

long stops_and_clears(const std::string& address, double scale) {
  return storm(address, 5.0 * scale, [](client::Client& client) {
    client.stop("storm");
    client.clear();
  });
}

long clock_exchanges(const std::string& address, double scale) {
  return storm(address, 5.0 * scale, [](client::Client& client) { client.exchange_clocks({}); });
}

/// The loop by itself, for the others to be compared with.
long nothing(const std::string& /*address*/, double scale) {
  std::this_thread::sleep_for(std::chrono::duration<double>(10.0 * scale));
  return 0;
}

constexpr Flood kFloods[] = {{"none", nothing},
                             {"large_texts", large_texts},
                             {"subscribers_that_never_read", subscribers_that_never_read},
                             {"unfinished_uploads", unfinished_uploads},
                             {"leases_and_takes", leases_and_takes},
                             {"stops_and_clears", stops_and_clears},
                             {"clock_exchanges", clock_exchanges}};

constexpr const char* kFloodsPart = "floods";

struct Outcome {
  long inputs = 0;
  double growth_mb = 0.0;
  double max_late_us = 0.0;  ///< the loop's latest wake-up
  bool crashed = false;
};

Outcome attack_daemon(const Flood& attack, double scale, const std::filesystem::path& logs) {
  DaemonProcess daemon(logs / (std::string("hapticd_") + attack.name + ".log"));
  client::Client client({.address = daemon.address()});
  client.rig_state();
  const double before_mb = test::resident_mb(daemon.pid());
  Outcome outcome;
  outcome.inputs = attack.run(daemon.address(), scale);
  outcome.growth_mb = test::max_resident_mb(daemon.pid()) - before_mb;
  try {
    client::Client afterwards({.address = daemon.address(), .timeout = kTimeout});
    const v1::LoopState loop = afterwards.rig_state().loop();
    outcome.crashed = !loop.running();
    outcome.max_late_us = loop.wakeup().max_us();
  } catch (const client::Error&) {
    outcome.crashed = true;
  }
  outcome.crashed = daemon.stop() != 0 || outcome.crashed;
  return outcome;
}

/// The speed of an upload, and what floods of calls make of memory and loop. Returns how many daemons ended.
int measure_floods(report::Report& report, const std::filesystem::path& logs, double scale) {
  report::Figure speed{.figure = "upload_mb_per_s", .unit = "MB/s"};
  const auto bytes = static_cast<std::uint64_t>(200e6 * scale);
  try {
    DaemonProcess daemon(logs / "hapticd_upload.log");
    client::Client client({.address = daemon.address()});
    speed.value = upload(client, bytes);
  } catch (const std::exception& error) {
    speed.failed = error.what();
  }
  report.add(speed);

  report::MarkdownTable table{{"attack", "inputs", "growth of the resident memory [MB]",
                               "latest wake-up of the loop [µs]", "serves afterwards", "failed"}};
  int crashes = 0;
  for (const Flood& attack : kFloods) {
    report::Report::note(std::string(attack.name) + " …");
    const report::Case conditions{{"attack", attack.name}};
    report::Figure growth{.figure = "attack_rss_growth_mb", .conditions = conditions, .unit = "MB"};
    report::Figure late{.figure = "attack_loop_lateness_max_us", .conditions = conditions, .unit = "µs"};
    report::Figure inputs{.figure = "inputs_tried", .conditions = conditions, .unit = "1"};
    bool serves = false;
    try {
      const Outcome outcome = attack_daemon(attack, scale, logs);
      inputs.value = static_cast<double>(outcome.inputs);
      growth.value = outcome.growth_mb;
      late.value = outcome.max_late_us;
      serves = !outcome.crashed;
      if (outcome.crashed) ++crashes;
    } catch (const std::exception& error) {
      growth.failed = late.failed = inputs.failed = error.what();
    }
    const auto shown = [](const report::Figure& figure) {
      return figure.value ? fixed(*figure.value, 0) : report::kNoNumber;
    };
    table.add_row(
        {attack.name, shown(inputs), shown(growth), shown(late), serves ? "yes" : "no", growth.failed});
    for (const report::Figure& figure : {inputs, growth, late}) report.add(figure);
  }
  report.add_table("attack", "What one client can do to the daemon", table,
                   "Each flood meets a daemon of its own, on loopback.");
  return crashes;
}

/// All the descriptors there are: one a connection.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

std::vector<std::string> attack_parts() {
  std::vector<std::string> parts = names_of_attacks();
  parts.insert(parts.begin(), kFloodsPart);
  return parts;
}

int run_attack(const AttackOptions& options) {
  raise_descriptor_limit();
  report::Report report(options.folder);
  const std::filesystem::path logs = report.folder() / "attack";
  std::filesystem::create_directories(logs);
  const double scale = options.quick ? 0.1 : 1.0;

  double crashes = 0.0;
  if (options.only.empty() || std::count(options.only.begin(), options.only.end(), kFloodsPart) > 0) {
    crashes += measure_floods(report, logs, scale);
  }
  crashes += measure_stops_under_attack(report, {scale, options.only});
  report.add({.figure = "attack_crashes", .value = crashes, .unit = "1", .goal = 0.0});
  return 0;
}

}  // namespace hapticd::bench
