#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <string>
#include <vector>

namespace hapticd::server {

/// The readable part of a StopRequest.
struct StopReason {
  std::string text;                  ///< one line of UTF-8, at most kMaxStopReason bytes
  std::vector<std::string> repairs;  ///< what was wrong with the request, as text
};

inline constexpr std::size_t kMaxStopReason = 256;  ///< bytes that are kept of a reason

/// Reads a StopRequest from any bytes: cut short, of another message, or with a reason that is not UTF-8.
/// Never fails.
StopReason read_stop_request(const grpc::ByteBuffer& request);
/// Reads a stop request from its bytes.
StopReason read_stop_request(std::string_view bytes);

}  // namespace hapticd::server
