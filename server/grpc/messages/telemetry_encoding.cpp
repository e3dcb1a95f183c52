#include "server/grpc/messages/telemetry_encoding.h"

#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "server/grpc/messages/telemetry_columns.h"
#include "server/grpc/messages/telemetry_messages.h"

namespace hapticd::server {

namespace {

/// Encodes a batch of only this sample. Encoded messages may be concatenated: their repeated fields add up.
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

grpc::ByteBuffer bytes_of(const std::string& message) {
  const grpc::Slice slice(message);
  return grpc::ByteBuffer(&slice, 1);
}

void describe_column(const char* name, const char* unit, v1::ColumnType type, v1::TelemetryBlock& block) {
  v1::TelemetryColumn& column = *block.add_columns();
  column.set_name(name);
  column.set_unit(unit);
  column.set_type(type);
}

/// Appends a cell; the machine is little-endian, as all that hapticd runs on.
template <class T>
void append(T value, std::string& rows) {
  static_assert(sizeof(T) == 8 && std::endian::native == std::endian::little);
  char bytes[8];
  std::memcpy(bytes, &value, 8);
  rows.append(bytes, 8);
}

void append_row(const rt::TickRecord& record, std::uint32_t channels, std::string& rows) {
  append(static_cast<std::int64_t>(record.tick), rows);
  append(record.time_ns, rows);
  append(static_cast<std::int64_t>(record.scene_generation), rows);
  for (const TelemetryColumn& column : telemetry_columns()) {
    if ((column.channel & channels) == 0) continue;
    const bool is_there = (column.channel & record.channels) != 0;
    append(is_there ? column.value(record) : std::numeric_limits<double>::quiet_NaN(), rows);
  }
}

}  // namespace

grpc::ByteBuffer encode(const Subscription::Batch& batch, std::uint32_t channels) {
  std::string message = encode_drops(batch);
  for (const Subscription::Entry& entry : batch.entries)
    entry.append_encoded(message, channels, encode_sample);
  return bytes_of(message);
}

grpc::ByteBuffer encode_block(const Subscription::Batch& batch, std::uint32_t channels, bool describe) {
  v1::TelemetryBatch message;
  message.set_dropped_by_subscriber(batch.dropped_by_subscriber);
  message.set_dropped_by_server(batch.dropped_by_server);
  v1::TelemetryBlock& block = *message.mutable_block();
  if (describe) {
    for (const char* name : {"tick", "time_ns", "scene_generation"}) {
      describe_column(name, name == std::string_view("time_ns") ? "ns" : "1", v1::COLUMN_TYPE_INT64, block);
    }
    for (const TelemetryColumn& column : telemetry_columns()) {
      if ((column.channel & channels) != 0) {
        describe_column(column.name, column.unit, v1::COLUMN_TYPE_FLOAT64, block);
      }
    }
  }
  for (const Subscription::Entry& entry : batch.entries)
    append_row(entry.record(), channels, *block.mutable_rows());
  return bytes_of(message.SerializeAsString());
}

}  // namespace hapticd::server
