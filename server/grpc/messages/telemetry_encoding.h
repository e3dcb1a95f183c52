#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>

#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Encodes a batch as bytes: a v1::TelemetryBatch with the groups that exist and were asked for (bits of
/// rt::channel). Samples that several subscribers share are encoded once and copied.
grpc::ByteBuffer encode(const Subscription::Batch& batch, std::uint32_t channels);

/// Encodes a batch as a v1::TelemetryBlock of the columns of these channels; `describe`: with their names and
/// units, as the first of a stream.
grpc::ByteBuffer encode_block(const Subscription::Batch& batch, std::uint32_t channels, bool describe);

}  // namespace hapticd::server
