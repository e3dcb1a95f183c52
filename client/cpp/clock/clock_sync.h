#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/cpp/client.h"
#include "client/cpp/clock/clock_link.h"

namespace hapticd::client {

struct ClockSyncOptions {
  /// Drift of the daemon's clock against this one, 0.001 … 10000 ppm. The bounds hold only if this does.
  double max_drift_ppm = ClockEstimator::kDefaultMaxDriftPpm;
  /// Pause between two rounds of five exchanges in the first two seconds; the next one is for later.
  std::chrono::milliseconds first_pause{10};
  std::chrono::milliseconds pause{100};
};

/// A time of the daemon's clock.
struct DaemonTime {
  std::int64_t daemon_ns = 0;  ///< CLOCK_MONOTONIC of the daemon's machine
  double bound_ms = 0.0;       ///< how wrong this can be at most
};

/// A time of the rig's clock, on which telemetry and `at_time_ns` of targets count.
struct RigTime {
  std::int64_t rig_ns = 0;  ///< from the start of the daemon
  double bound_ms = 0.0;    ///< how wrong this can be at most
};

/// Exchanges stamps with a daemon in the background, and converts times of this machine's CLOCK_MONOTONIC
/// (std::chrono::steady_clock) into those of the daemon's. Any thread.
///
///     hapticd::client::ClockSync clock(client);
///     const auto exposed = clock.to_daemon(camera_stamp_ns);  // exposed.daemon_ns ± exposed.bound_ms
class ClockSync {
 public:
  /// Makes the first exchange; `client` must outlive it. Throws Error: of the call, or kBadClock.
  explicit ClockSync(Client& client, ClockSyncOptions options = {});
  ~ClockSync();
  ClockSync(const ClockSync&) = delete;
  ClockSync& operator=(const ClockSync&) = delete;

  /// Clock of this machine, in ns.
  static std::int64_t now_ns();
  /// Bounds of the offset (daemon's clock minus this one), now. Throws Error as to_daemon().
  ClockBounds bounds() const;
  ClockDrift drift() const;
  /// Later times never become earlier ones, nor jump: see ClockConverter. It begins afresh only after a clock
  /// ran backwards or was set, or the daemon's machine was started again. Throws Error (kBadClock) until
  /// then, and for a time more than 1 s ahead of now.
  DaemonTime to_daemon(std::int64_t client_ns) const;
  /// Converts to the rig's clock. Throws Error (kBadClock) also if no tick of the rig is known, and if the
  /// rig has its own time: in a replay.
  RigTime to_rig(std::int64_t client_ns) const;
  /// Why the last exchange failed; nothing if it did not. The bounds widen meanwhile.
  std::optional<Error> problem() const;
  /// Why a reading in the last round of exchanges did not fit the rig's clock, which was begun afresh;
  /// nothing if all did. The daemon's clock stays known.
  std::optional<Error> rig_problem() const;
  /// Exchanges that went well.
  std::uint64_t exchanges() const;

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
