#include "server/grpc/messages/telemetry_encoding.h"

#include <string>

#include "server/grpc/messages/telemetry_messages.h"

namespace hapticd::server {

namespace {

/// A batch of only this sample. Encoded messages may be concatenated: their repeated
/// fields add up.
std::string encode_sample(const rt::TickRecord& record, std::uint32_t channels) {
  v1::TelemetryBatch alone;
  fill(record, channels, *alone.add_samples());
  return alone.SerializeAsString();
}

std::string encode_drops(const Subscription::Batch& batch) {
  v1::TelemetryBatch drops;
  drops.set_dropped_by_subscriber(batch.dropped_by_subscriber);
  drops.set_dropped_by_server(batch.dropped_by_server);
  return drops.SerializeAsString();
}

}  // namespace

grpc::ByteBuffer encode(const Subscription::Batch& batch, std::uint32_t channels) {
  std::string message = encode_drops(batch);
  for (const Subscription::Entry& entry : batch.entries) message += entry.encoded(channels, encode_sample);
  const grpc::Slice slice(message);
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace hapticd::server
