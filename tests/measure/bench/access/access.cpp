#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/access/block_decode.h"
#include "tests/measure/bench/access/clock.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using client::Client;
using report::fixed;

constexpr std::chrono::seconds kPatience{60};
constexpr const char* kWithoutNotice = "[access]\ntake_notice_s = 0\n";

double ms_since(Clock::time_point began) {
  return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) throw std::runtime_error("nothing was measured");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

v1::SetTargetRequest target(double stiffness_n_per_mm) {
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(stiffness_n_per_mm);
  return request;
}

/// A figure of what `measure` returns, or of why it does not.
template <class Measure>
report::Figure measured(report::Figure figure, Measure measure) {
  try {
    figure.value = measure();
  } catch (const std::exception& error) {
    figure.failed = error.what();
  }
  return figure;
}

/// How often something that the old holder of a lease had sent took effect at the second tick after the last
/// one that was reported to the taker, or later.
double race_violations(const std::filesystem::path& logs, int races) {
  DaemonProcess daemon(logs / "hapticd_race.log", {.more_configuration = kWithoutNotice});
  Client one({.address = daemon.address(), .timeout = kPatience});
  Client other({.address = daemon.address(), .timeout = kPatience});
  Client* holder = &one;
  Client* taker = &other;
  holder->acquire_lease({});
  v1::TakeLeaseRequest request;
  request.set_reason("race");
  int violations = 0;
  for (int race = 0; race < races; ++race) {
    std::atomic<bool> taken{false};
    std::atomic<int> sent{0};
    std::uint64_t last_effect = 0;
    std::thread setting([&] {
      while (!taken) {
        ++sent;
        try {
          last_effect =
              std::max<std::uint64_t>(last_effect, holder->set_target(target(0.3)).effective_tick());
        } catch (const client::Error&) {
          // Refused, as it should be from now on.
        }
      }
    });
    while (sent == 0) std::this_thread::yield();
    const auto granted = taker->take_lease(request);
    taken = true;
    setting.join();
    if (last_effect > granted.changed_after_tick() + 1) ++violations;
    std::swap(holder, taker);
  }
  return violations;
}

/// Targets that wait for their time, so that they use up the threads of calls.
class WaitingCalls {
 public:
  WaitingCalls(Client& client, int count) {
    auto request = target(0.3);
    request.set_at_time_ns(client.rig_state().time_ns() + 55'000'000'000);
    for (int i = 0; i < count; ++i) {
      threads_.emplace_back([&client, request] {
        try {
          client.set_target(request);
        } catch (const client::Error&) {
          // Withdrawn with the daemon's end, or one too many.
        }
      });
    }
  }
  ~WaitingCalls() {
    for (std::thread& thread : threads_) thread.join();
  }
  WaitingCalls(const WaitingCalls&) = delete;
  WaitingCalls& operator=(const WaitingCalls&) = delete;

 private:
  std::vector<std::thread> threads_;
};

/// Upper bounds, in ms, of the time from a client's stop to the tick that obeys it: until the answer, which
/// is sent once the loop has the stop, and one period more.
std::vector<double> stops(const std::string& address, int count) {
  constexpr double kPeriodMs = 1.0;
  Client client({.address = address, .timeout = kPatience});
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const auto began = Clock::now();
    client.stop("bench");
    times.push_back(ms_since(began) + kPeriodMs);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return times;
}

std::vector<double> stops_when_idle(const std::filesystem::path& logs, int count) {
  DaemonProcess daemon(logs / "hapticd_stop_idle.log");
  return stops(daemon.address(), count);
}

std::vector<double> stops_under_load(const std::filesystem::path& logs, int count) {
  constexpr int kWaiting = 64;
  constexpr int kSubscribers = 200;
  constexpr int kPerConnection = 50;
  DaemonProcess daemon(logs / "hapticd_stop_load.log");
  Client holder({.address = daemon.address(), .timeout = kPatience});
  holder.acquire_lease({});
  std::vector<Client> subscribers;
  std::vector<client::TelemetryStream> streams;
  for (int i = 0; i < kSubscribers; ++i) {
    if (i % kPerConnection == 0)
      subscribers.emplace_back(client::ClientOptions{.address = daemon.address(), .timeout = kPatience});
    v1::SubscribeRequest request;
    request.set_decimation(10);
    streams.push_back(subscribers.back().subscribe(request));
  }
  std::atomic<bool> over{false};
  std::thread reading([&] {
    v1::TelemetryBatch batch;
    while (!over) {
      for (auto& stream : streams) stream.next(batch, std::chrono::milliseconds(0));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  std::vector<double> times;
  {
    const WaitingCalls waiting(holder, kWaiting);
    std::this_thread::sleep_for(std::chrono::seconds(1));
    times = stops(daemon.address(), count);
    over = true;
    reading.join();
    streams.clear();
    daemon.stop();
  }
  return times;
}

/// A loopback port that is free now.
std::uint16_t free_port() {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  bind(descriptor, reinterpret_cast<sockaddr*>(&address), length);
  getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length);
  close(descriptor);
  return ntohs(address.sin_port);
}

/// Median of a short call with certificates, as a multiple of the same call without, taken in turn.
double mtls_over_plain(const std::filesystem::path& logs, int calls) {
  const std::filesystem::path lab = logs / "lab";
  const auto made = report::run_program(
      {.command = {"bash", SOURCE_FOLDER "/deploy/make_certificates.sh", "--lab", "bench", "--out",
                   lab.string(), "--server", "localhost,127.0.0.1", "--client", "operator/bench"}},
      kPatience);
  if (made.status != 0) throw std::runtime_error("no certificates: " + made.output);
  const std::string port = std::to_string(free_port());
  DaemonProcess daemon(
      logs / "hapticd_tls.log",
      {.more_configuration = "[network]\nlisten_tls = \"127.0.0.1:" + port + "\"\ncertificates = \"" +
                             (lab / "servers/localhost").string() + "\"\n"});
  Client plain({.address = daemon.address(), .timeout = kPatience});
  Client with({.address = "tls:127.0.0.1:" + port,
               .timeout = kPatience,
               .certificates = (lab / "clients/bench").string()});
  std::vector<double> plain_ms;
  std::vector<double> with_ms;
  const auto time = [](Client& client) {
    const auto began = Clock::now();
    client.lease();
    return ms_since(began);
  };
  for (int i = 0; i < calls; ++i) {
    plain_ms.push_back(time(plain));
    with_ms.push_back(time(with));
  }
  return quantile(with_ms, 0.5) / quantile(plain_ms, 0.5);
}

/// How long beyond its time to live the force of a holder stays that is stopped (SIGSTOP), in s. The hand
/// presses meanwhile.
double force_beyond_ttl_s(const std::filesystem::path& logs) {
  constexpr double kTtlS = 1.0;
  DaemonProcess daemon(logs / "hapticd_frozen.log");
  Client watcher({.address = daemon.address(), .timeout = kPatience});
  v1::HandProgram press;
  press.set_kind(v1::HAND_PROGRAM_KIND_PRESS);
  press.set_force_n(3.0);
  press.set_hold_s(-1.0);
  watcher.set_hand_program(press);
  watcher.set_target(target(0.9));
  report::ChildProcess holder(
      {.command = {(program_folder() / "hapticctl").string(), "--server", daemon.address(), "lease", "hold",
                   "--ttl", "1", "--on-expiry", "ramp_to_zero", "--", "sleep", "60"},
       .output = logs / "holder.log"});
  const auto until = Clock::now() + kPatience;
  const auto force_n = [](const v1::TelemetrySample& sample) {
    const v1::Vector3& force = sample.guard().device_command_n();
    return std::max({std::abs(force.x()), std::abs(force.y()), std::abs(force.z())});
  };
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_GUARD);
  request.set_batch_size(1);
  client::TelemetryStream stream = watcher.subscribe(request);
  v1::TelemetryBatch batch;
  bool stopped = false;
  Clock::time_point stopped_at{};
  while (Clock::now() < until) {
    if (stream.next(batch, std::chrono::milliseconds(50)) != client::TelemetryStream::Event::kMessage)
      continue;
    for (const auto& sample : batch.samples()) {
      if (!stopped && force_n(sample) > 0.1 && watcher.lease().has_lease()) {
        holder.signal(SIGSTOP);
        stopped_at = Clock::now();
        stopped = true;
      } else if (stopped && force_n(sample) == 0.0) {
        return 1e-3 * ms_since(stopped_at) - kTtlS;
      }
    }
  }
  throw std::runtime_error(stopped ? "the force stays" : "no force was rendered");
}

/// Batches as a live view takes them, and those of a client that takes everything.
constexpr unsigned kLiveBatch = 20;
constexpr unsigned kBulkBatch = 100;

/// Measures one language, with batches of this size at 1 kHz; `add` as in run_access().
template <class Add>
void add_decode_cost(const std::filesystem::path& folder, double seconds, bool python, unsigned batch_size,
                     Add add) {
  const char* language = python ? "python" : "cpp";
  const std::string size = std::to_string(batch_size);
  DecodeCost cost;
  std::string failed;
  try {
    const RecordedBatches batches(folder / (language + size), seconds, batch_size);
    cost = python ? batches.decoded_in_python() : batches.decoded_in_cpp();
  } catch (const std::exception& error) {
    failed = error.what();
  }
  for (const bool blocks : {false, true}) {
    const char* encoding = blocks ? "block" : "samples";
    report::Figure figure{
        .figure = "block_decode_us_per_sample",
        .conditions = {{"language", language}, {"encoding", encoding}, {"batch", batch_size}},
        .unit = "µs",
        .failed = failed};
    if (failed.empty()) figure.value = blocks ? cost.blocks_us : cost.samples_us;
    add(std::string("block_decode_us_per_sample, ") + language + ", " + encoding + ", " + size, figure);
  }
  report::Figure ratio{.figure = "block_decode_gain",
                       .conditions = {{"language", language}, {"batch", batch_size}},
                       .goal = python ? std::optional(100.0) : std::nullopt,
                       .source = "fields over blocks",
                       .failed = failed};
  if (failed.empty()) ratio.value = cost.samples_us / cost.blocks_us;
  add(std::string("block_decode_gain, ") + language + ", " + size, ratio);
}

/// Both languages, both sizes of batches.
template <class Add>
void add_decode_costs(const std::filesystem::path& folder, double seconds, Add add) {
  for (const bool python : {false, true}) {
    for (const unsigned batch_size : {kLiveBatch, kBulkBatch})
      add_decode_cost(folder, seconds, python, batch_size, add);
  }
}

/// Calls every method of the contract with requests made from its descriptors, against a separate daemon for
/// each seed.
template <class Add>
void add_rpc_fuzz(int seeds, const Add& add) {
  report::Figure inputs{.figure = "rpc_fuzz_inputs", .value = 0.0};
  report::Figure failures{.figure = "rpc_fuzz_failures", .value = 0.0, .goal = 0.0};
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto ran = report::run_program({.command = {FUZZ_RPC_CALLS, "2000", std::to_string(seed)}},
                                         std::chrono::seconds(120));
    const std::size_t line = ran.output.rfind('\n', ran.output.empty() ? 0 : ran.output.size() - 2);
    long tried = 0;
    long failed = 0;
    if (std::sscanf(ran.output.c_str() + (line == std::string::npos ? 0 : line + 1),
                    "%ld inputs, %ld failures", &tried, &failed) != 2) {
      inputs.failed = failures.failed = "seed " + std::to_string(seed) + " did not end: " + ran.output;
      inputs.value = failures.value = std::nullopt;
      break;
    }
    *inputs.value += static_cast<double>(tried);
    *failures.value += static_cast<double>(failed);
  }
  add("rpc_fuzz_inputs, " + std::to_string(seeds) + " seeds", inputs);
  add("rpc_fuzz_failures", failures);
}

}  // namespace

int run_access(const AccessOptions& options) {
  report::Report report(options.folder);
  const std::filesystem::path logs = report.folder() / "access";
  std::filesystem::create_directories(logs);
  const int share = options.quick ? 10 : 1;
  report::MarkdownTable table{{"figure", "value", "unit", "goal", "failed"}};
  const auto add = [&](const std::string& name, const report::Figure& figure) {
    report.add(figure);
    table.add_row({name, figure.value ? fixed(*figure.value, 3) : report::kNoNumber, figure.unit,
                   figure.goal ? fixed(*figure.goal, 1) : "", figure.failed});
  };
  const int races = 10'000 / share;
  report::Report::note("races …");
  add("lease_race_violations, " + std::to_string(races) + " races",
      measured({.figure = "lease_race_violations", .goal = 0.0},
               [&] { return race_violations(logs, races); }));
  for (const bool loaded : {false, true}) {
    report::Report::note(loaded ? "stops under load …" : "stops …");
    std::vector<double> times;
    std::string failed;
    try {
      times = loaded ? stops_under_load(logs, 5'000 / share) : stops_when_idle(logs, 5'000 / share);
    } catch (const std::exception& error) {
      failed = error.what();
    }
    for (const double share_of_stops : {0.5, 0.999}) {
      const char* load = loaded ? "64_waiting_200_subscribers" : "idle";
      report::Figure figure{.figure = "stop_to_tick_ms",
                            .conditions = {{"quantile", share_of_stops}, {"load", load}},
                            .unit = "ms",
                            .goal = share_of_stops == 0.5 ? 2.0 : 20.0,
                            .failed = failed};
      if (!times.empty()) figure.value = quantile(times, share_of_stops);
      add(std::string("stop_to_tick_ms, quantile ") + fixed(share_of_stops, 3) + ", " + load, figure);
    }
  }
  report::Report::note("certificates …");
  add("mtls_over_plain", measured({.figure = "mtls_over_plain", .goal = 1.6},
                                  [&] { return mtls_over_plain(logs, 5'000 / share); }));
  report::Report::note("a holder that freezes …");
  add("force_beyond_ttl_s", measured({.figure = "force_beyond_ttl_s", .unit = "s", .goal = 0.1},
                                     [&] { return force_beyond_ttl_s(logs); }));
  report::Report::note("calls made from the contract …");
  add_rpc_fuzz(options.quick ? 1 : 20, add);
  report::Report::note("clocks …");
  add_clock_figures(logs, options.quick, add);
  report::Report::note("decoding …");
  add_decode_costs(logs / "decode", options.quick ? 2.0 : 5.0, add);
  report.add_table(
      "access", "Access and exclusive control", table,
      "Loopback. stop_to_tick_ms: an upper bound, until the answer and one period of the loop more.");
  return 0;
}

}  // namespace hapticd::bench
