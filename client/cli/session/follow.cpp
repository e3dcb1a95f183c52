#include "client/cli/session/follow.h"

#include <cmath>

#include "client/cli/session/interrupt.h"

namespace hapticd::cli {

FollowResult follow(client::TelemetryStream& stream, std::uint32_t decimation, const FollowLimits& limits,
                    const std::function<void(const v1::TelemetrySample&)>& on_sample,
                    const std::function<void()>& on_idle) {
  FollowResult result;
  result.account = client::StreamAccount(decimation);
  const std::int64_t duration_ns = std::llround(limits.seconds * 1e9);
  std::int64_t first_time_ns = 0;
  auto last_arrival = std::chrono::steady_clock::now();
  v1::TelemetryBatch batch;

  while (!interrupted()) {
    const auto event = stream.next(batch, std::chrono::milliseconds(50));
    if (event == client::TelemetryStream::Event::kEnded) {
      result.end = StreamEnd::kClosedByDaemon;
      return result;
    }
    if (event == client::TelemetryStream::Event::kMessage) {
      last_arrival = std::chrono::steady_clock::now();
      result.account.set_dropped(batch.dropped_by_subscriber(), batch.dropped_by_server());
      for (const auto& sample : batch.samples()) {
        if (result.account.samples() == 0) first_time_ns = sample.time_ns();
        if (duration_ns > 0 && sample.time_ns() - first_time_ns >= duration_ns) return result;
        result.account.add(sample.tick());
        on_sample(sample);
        if (limits.samples > 0 && result.account.samples() >= limits.samples) return result;
      }
    } else if (std::chrono::steady_clock::now() - last_arrival > limits.silence) {
      result.end = StreamEnd::kSilent;
      return result;
    }
    on_idle();
    if (limits.enough && limits.enough()) return result;
  }
  result.end = StreamEnd::kInterrupted;
  return result;
}

}  // namespace hapticd::cli
