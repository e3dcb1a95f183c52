#include "tests/bench/live/subscriber.h"

#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "client/cpp/client.h"
#include "tests/bench/live/daemon_process.h"

namespace hapticd::bench {

// Outside the unnamed namespace: nlohmann-json finds it through the type.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SubscriberTally, samples, gaps, missing, disordered, dropped_by_subscriber,
                                   dropped_by_server)

namespace {

SubscriberTally tally_of(const client::StreamAccount& account) {
  return {.samples = account.samples(),
          .gaps = account.gaps(),
          .missing = account.missing(),
          .disordered = account.disordered(),
          .dropped_by_subscriber = account.dropped_by_subscriber(),
          .dropped_by_server = account.dropped_by_server()};
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
  return *this;
}

SubscriberProcess::SubscriberProcess(const std::string& address, double seconds, std::filesystem::path result)
    : result_(std::move(result)),
      patience_(in_ms(seconds + 20.0)),
      process_({.command = {(program_folder() / "hapticd_bench").string(), "live-child", "--server", address,
                            "--seconds", std::to_string(seconds), "--result", result_.string()},
                .output = result_.string() + ".log"}) {}

void SubscriberProcess::stall() noexcept {
  process_.signal(SIGSTOP);
}
void SubscriberProcess::kill() noexcept {
  process_.signal(SIGKILL);
}

SubscriberTally SubscriberProcess::finish() {
  const auto status = process_.wait(patience_);
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

int run_subscriber(const std::string& address, double seconds, const std::filesystem::path& result) {
  client::Client client({.address = address});
  client::TelemetryStream stream = client.subscribe({});
  hapticd::v1::TelemetryBatch batch;
  const auto end = std::chrono::steady_clock::now() + in_ms(seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (stream.next(batch, std::chrono::milliseconds(200)) == client::TelemetryStream::Event::kEnded) {
      std::cerr << "the daemon ended the stream" << std::endl;
      return 1;
    }
  }
  std::ofstream(result) << nlohmann::json(tally_of(stream.account())) << '\n';
  return 0;
}

}  // namespace hapticd::bench
