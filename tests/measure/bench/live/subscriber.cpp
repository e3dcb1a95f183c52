#include "tests/measure/bench/live/subscriber.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <fstream>
#include <iostream>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/daemon_process.h"

namespace hapticd::bench {

// Outside the unnamed namespace: nlohmann-json finds it through the type.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SubscriberTally, samples, gaps, missing, disordered, dropped_by_subscriber,
                                   dropped_by_server, bytes, behind_ms)

namespace {

SubscriberTally tally_of(const client::StreamAccount& account) {
  return {.samples = account.samples(),
          .gaps = account.gaps(),
          .missing = account.missing(),
          .disordered = account.disordered(),
          .dropped_by_subscriber = account.dropped_by_subscriber(),
          .dropped_by_server = account.dropped_by_server()};
}

/// What one stream received.
struct Received {
  SubscriberTally tally;
  std::int64_t newest_ns = 0;  ///< the rig's time of the newest sample
};

/// Reads; none when the daemon ended the stream.
std::optional<Received> read_until(const std::string& address, std::chrono::steady_clock::time_point end,
                                   bool blocks) {
  client::Client client({.address = address, .timeout = std::chrono::seconds(20)});
  v1::SubscribeRequest request;
  if (blocks) request.set_encoding(v1::TELEMETRY_ENCODING_BLOCK);
  client::TelemetryStream stream = client.subscribe(request);
  hapticd::v1::TelemetryBatch batch;
  Received received;
  std::uint64_t bytes = 0;
  while (std::chrono::steady_clock::now() < end) {
    const auto event = stream.next(batch, std::chrono::milliseconds(200));
    if (event == client::TelemetryStream::Event::kEnded) return std::nullopt;
    if (event != client::TelemetryStream::Event::kMessage) continue;
    bytes += batch.ByteSizeLong();
    if (!batch.samples().empty()) received.newest_ns = batch.samples().rbegin()->time_ns();
    const client::TelemetryTable& table = stream.table();
    if (blocks && table.rows() > 0)
      received.newest_ns = table.integer(table.rows() - 1, table.column("time_ns").value());
  }
  received.tally = tally_of(stream.account());
  received.tally.bytes = bytes;
  return received;
}

std::chrono::milliseconds in_ms(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds));
}

}  // namespace

SubscriberTally& SubscriberTally::operator+=(const SubscriberTally& other) noexcept {
  samples += other.samples;
  gaps += other.gaps;
  missing += other.missing;
  disordered += other.disordered;
  dropped_by_subscriber += other.dropped_by_subscriber;
  dropped_by_server += other.dropped_by_server;
  bytes += other.bytes;
  behind_ms = std::max(behind_ms, other.behind_ms);
  return *this;
}

SubscriberProcess::SubscriberProcess(const std::string& address, double seconds, std::filesystem::path result,
                                     int streams, bool blocks)
    : result_(std::move(result)),
      timeout_(in_ms(seconds + 20.0)),
      process_({.command = {(program_folder() / "hapticd_bench").string(), "subscriber-child", "--server",
                            address, "--seconds", std::to_string(seconds), "--result", result_.string(),
                            "--streams", std::to_string(streams), "--blocks", blocks ? "1" : "0"},
                .output = result_.string() + ".log"}) {}

SubscriberTally SubscriberProcess::finish() {
  const auto status = process_.wait(timeout_);
  std::ifstream file(result_);
  const auto tally = nlohmann::json::parse(file, nullptr, false);
  if (status != 0 || !tally.is_object()) {
    std::ostringstream said;
    said << std::ifstream(result_.string() + ".log").rdbuf();
    throw std::runtime_error("a subscriber ended with status " + std::to_string(status.value_or(-1)) + ": " +
                             said.str());
  }
  return tally.get<SubscriberTally>();
}

int run_subscriber_child(const std::string& address, double seconds, const std::string& result, int streams,
                         bool blocks) {
  const auto end = std::chrono::steady_clock::now() + in_ms(seconds);
  SubscriberTally sum;
  std::int64_t oldest_ns = std::numeric_limits<std::int64_t>::max();  // of the newest of each stream
  bool ended_early = false;
  std::mutex mutex;
  {
    std::vector<std::jthread> readers;
    for (int i = 0; i < streams; ++i) {
      readers.emplace_back([&] {
        std::optional<Received> received;
        std::string why = "the daemon ended the stream";
        try {
          received = read_until(address, end, blocks);
        } catch (const std::exception& error) {
          why = error.what();
        }
        const std::lock_guard lock(mutex);
        if (received) {
          sum += received->tally;
          oldest_ns = std::min(oldest_ns, received->newest_ns);
        } else {
          ended_early = true;
          std::cerr << why << std::endl;
        }
      });
    }
  }
  if (ended_early) return 1;
  client::Client client({.address = address, .timeout = std::chrono::seconds(20)});
  sum.behind_ms = 1e-6 * static_cast<double>(client.rig_state().time_ns() - oldest_ns);
  std::ofstream(result) << nlohmann::json(sum) << '\n';
  return 0;
}

}  // namespace hapticd::bench
