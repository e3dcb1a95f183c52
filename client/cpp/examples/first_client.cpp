// Has the simulated hand press a sponge and prints how stiff it feels at two targets.
#include <chrono>
#include <cstdio>

#include "client/cpp/client.h"

namespace v1 = hapticd::v1;
using hapticd::client::TelemetryStream;

/// Stiffness at the hand, N/mm: force over displacement, mean of 50 samples of a firm press; 0 if none came.
double felt_n_per_mm(hapticd::client::Client& client) {
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_DEFORMATION);
  request.add_groups(v1::FIELD_GROUP_CONTROL);
  request.set_decimation(10);  // every tenth tick: 100 samples a second
  TelemetryStream stream = client.subscribe(request);
  double sum_n_per_mm = 0.0;
  int samples = 0;
  v1::TelemetryBatch batch;
  for (int tries = 0; samples < 50 && tries < 1000; ++tries) {
    if (stream.next(batch, std::chrono::milliseconds(100)) == TelemetryStream::Event::kEnded) break;
    for (const v1::TelemetrySample& sample : batch.samples()) {
      if (sample.control().hand_force_n() < 1.9) continue;
      sum_n_per_mm += sample.control().hand_force_n() / sample.deformation().displacement_mm();
      ++samples;
    }
    batch.Clear();
  }
  return samples == 0 ? 0.0 : sum_n_per_mm / samples;
}

int main(int argc, char** argv) try {
  hapticd::client::Client client({.address = argc > 1 ? argv[1] : "127.0.0.1:50051",
                                  .acquires_lease = true,
                                  .lease_purpose = "first client"});
  client.load_scene({.name = "tap_1d"});
  for (const double target_n_per_mm : {0.3, 0.7}) {
    v1::SetTargetRequest target;
    target.set_stiffness_n_per_mm(target_n_per_mm);
    const v1::SetTargetResponse answer = client.set_target(target);
    v1::HandProgram hand;  // a firm press, again and again
    hand.set_kind(v1::HAND_PROGRAM_KIND_PRESS);
    hand.set_force_n(2.0);
    hand.set_repetitions(-1);
    client.set_hand_program(hand);
    std::printf("granted %.2f N/mm, felt %.2f N/mm\n", answer.granted_n_per_mm(), felt_n_per_mm(client));
  }
  return 0;
} catch (const hapticd::client::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());  // what, where, the limit and the remedy, in one line
  if (error.kind() == hapticd::client::ErrorKind::kUnreachable) {
    std::fprintf(stderr, "first_client takes no options: the address is its argument\n");
  }
  return 1;
}
