#include "tests/measure/bench/decode/block_decode.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "client/cpp/client.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/child_process.h"

namespace hapticd::bench {
namespace {

using DecodeClock = std::chrono::steady_clock;

constexpr int kRepetitions = 5;

std::filesystem::path file_of(const std::filesystem::path& folder, bool blocks) {
  return folder / (blocks ? "blocks.bin" : "samples.bin");
}

/// Each message behind its length in four bytes, the lowest first.
void record(const std::string& address, bool blocks, double seconds, unsigned batch_size,
            const std::filesystem::path& path) {
  client::Client client({.address = address, .timeout = std::chrono::seconds(20)});
  v1::SubscribeRequest request;
  request.set_batch_size(batch_size);
  if (blocks) request.set_encoding(v1::TELEMETRY_ENCODING_BLOCK);
  client::TelemetryStream stream = client.subscribe(request);
  std::ofstream file(path, std::ios::binary);
  v1::TelemetryBatch batch;
  const auto end = DecodeClock::now() + std::chrono::duration<double>(seconds);
  while (DecodeClock::now() < end) {
    if (stream.next(batch, std::chrono::milliseconds(100)) != client::TelemetryStream::Event::kMessage)
      continue;
    const std::string bytes = batch.SerializeAsString();
    for (int i = 0; i < 4; ++i) file.put(static_cast<char>(bytes.size() >> (8 * i) & 0xff));
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  if (stream.account().samples() == 0) throw std::runtime_error("no telemetry came");
}

std::vector<std::string> messages_in(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::string> messages;
  unsigned char length[4];
  while (file.read(reinterpret_cast<char*>(length), 4)) {
    std::string message(length[0] | length[1] << 8 | length[2] << 16 | std::size_t{length[3]} << 24, '\0');
    file.read(message.data(), static_cast<std::streamsize>(message.size()));
    messages.push_back(std::move(message));
  }
  return messages;
}

/// The best of some repetitions of `decode`, which returns how many samples it saw.
template <class Decode>
double us_per_sample(Decode decode) {
  double best_us = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepetitions; ++i) {
    const auto began = DecodeClock::now();
    const std::size_t samples = decode();
    const double us = std::chrono::duration<double, std::micro>(DecodeClock::now() - began).count();
    best_us = std::min(best_us, us / static_cast<double>(std::max<std::size_t>(1, samples)));
  }
  return best_us;
}

}  // namespace

RecordedBatches::RecordedBatches(std::filesystem::path folder, double seconds, unsigned batch_size)
    : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
  DaemonProcess daemon(folder_ / "hapticd.log", {.scene = "explore_rod"});
  for (const bool blocks : {false, true})
    record(daemon.address(), blocks, seconds, batch_size, file_of(folder_, blocks));
}

DecodeCost RecordedBatches::decoded_in_cpp() const {
  DecodeCost cost;
  volatile double used = 0.0;
  const auto samples = messages_in(file_of(folder_, false));
  cost.samples_us = us_per_sample([&] {
    std::size_t count = 0;
    v1::TelemetryBatch batch;
    for (const std::string& bytes : samples) {
      if (!batch.ParseFromString(bytes)) throw std::runtime_error("a batch cannot be parsed");
      for (const auto& sample : batch.samples()) used = used + sample.sample().sensor_force_n().z();
      count += static_cast<std::size_t>(batch.samples_size());
    }
    return count;
  });
  const auto blocks = messages_in(file_of(folder_, true));
  cost.blocks_us = us_per_sample([&] {
    std::size_t count = 0;
    v1::TelemetryBatch batch;
    client::TelemetryTable table;
    std::size_t column = 0;
    for (const std::string& bytes : blocks) {
      if (!batch.ParseFromString(bytes)) throw std::runtime_error("a batch cannot be parsed");
      const bool first = table.columns().empty();
      table.set(batch.block());
      if (first) column = table.column("sample_sensor_force_z_n").value();
      for (std::size_t row = 0; row < table.rows(); ++row) used = used + table.number(row, column);
      count += table.rows();
    }
    return count;
  });
  return cost;
}

DecodeCost RecordedBatches::decoded_in_python() const {
  const auto ran = report::run_program(
      {.command = {"/usr/bin/python3", SOURCE_FOLDER "/tests/measure/bench/decode/decode_batches.py",
                   SOURCE_FOLDER "/proto", folder_.string()}},
      std::chrono::seconds(300));
  const auto cost = nlohmann::json::parse(
      ran.output.substr(ran.output.rfind('{') == std::string::npos ? ran.output.size()
                                                                   : ran.output.rfind('{')),
      nullptr, false);
  if (ran.status != 0 || !cost.is_object())
    throw std::runtime_error("python3 with numpy and protobuf: " + ran.output);
  return {cost.at("samples_us").get<double>(), cost.at("blocks_us").get<double>()};
}

}  // namespace hapticd::bench
