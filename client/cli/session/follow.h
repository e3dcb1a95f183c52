#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include "client/cpp/message_stream.h"

namespace hapticd::cli {

/// Limits at which a followed stream ends by itself. 0 = no limit.
struct FollowLimits {
  double seconds = 0.0;  ///< of the rig's clock, from the first sample
  std::uint64_t samples = 0;
  /// The following ends after so long without a sample.
  std::chrono::milliseconds silence{5000};
  /// Asked after each batch: true ends it.
  std::function<bool()> enough{};
};

enum class StreamEnd { kLimitReached, kInterrupted, kClosedByDaemon, kSilent };

struct FollowResult {
  StreamEnd end = StreamEnd::kLimitReached;
  /// Account of the samples that were passed on.
  client::StreamAccount account;
};

/// Passes every sample of the stream to `on_sample` until a limit is reached, the user interrupts or the
/// stream ends; `on_idle` is called after each batch and at least ten times a second. Throws what the stream
/// throws.
FollowResult follow(client::TelemetryStream& stream, std::uint32_t decimation, const FollowLimits& limits,
                    const std::function<void(const v1::TelemetrySample&)>& on_sample,
                    const std::function<void()>& on_idle);

}  // namespace hapticd::cli
