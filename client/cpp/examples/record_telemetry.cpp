// Writes ten seconds of telemetry as CSV, and says how many samples were lost.
//   record_telemetry ADDRESS FILE      exit code 0: complete; 1: samples were lost, or an error; 2: wrong
//   usage
#include <chrono>
#include <cstdio>
#include <fstream>

#include "client/cpp/client.h"

namespace v1 = hapticd::v1;
using hapticd::client::TelemetryStream;

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: record_telemetry ADDRESS FILE\n");
    return 2;
  }
  hapticd::client::Client client({.address = argv[1]});
  v1::SubscribeRequest request;  // only what is written: groups that are not asked for cost nothing
  request.add_groups(v1::FIELD_GROUP_SAMPLE);
  request.add_groups(v1::FIELD_GROUP_GUARD);
  TelemetryStream stream = client.subscribe(request);

  std::ofstream file(argv[2]);
  file << "tick,time_s,tip_z_mm,sensor_force_z_n,device_command_z_n\n";  // the unit is part of the name
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  v1::TelemetryBatch batch;
  while (file && std::chrono::steady_clock::now() < end) {
    if (stream.next(batch, std::chrono::milliseconds(100)) == TelemetryStream::Event::kEnded) break;
    for (const v1::TelemetrySample& sample : batch.samples()) {
      file << sample.tick() << ',' << 1e-9 * static_cast<double>(sample.time_ns()) << ','
           << sample.sample().tip_position_mm().z() << ',' << sample.sample().sensor_force_n().z() << ','
           << sample.guard().device_command_n().z() << '\n';
    }
    batch.Clear();
  }
  if (!file) {
    std::fprintf(stderr, "%s cannot be written\n", argv[2]);
    return 1;
  }
  const hapticd::client::StreamAccount& account = stream.account();
  std::printf("%llu samples, %llu missing\n", static_cast<unsigned long long>(account.samples()),
              static_cast<unsigned long long>(account.missing()));
  return account.complete() ? 0 : 1;
} catch (const hapticd::client::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
