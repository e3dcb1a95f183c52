#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "client/cpp/client.h"

namespace hapticd::client {

/// One endpoint of the daemon's watchdog: while it does not check in, there is no force.
///
/// Nothing here checks in by itself: a program that hangs must be missing. Call check_in() where the program
/// shows that it works, e.g. once in its main loop, and at least every pause().
///
/// Threads: one at a time.
///
///     hapticd::client::WatchdogEndpoint pedal(client, "pedal");
///     while (reading) {
///       pedal.check_in(read_pedal());
///       std::this_thread::sleep_for(pedal.pause());
///     }
class WatchdogEndpoint {
 public:
  /// `client` must outlive it. `name`: as it is configured, [[watchdog.endpoint]]. Calls nothing yet.
  WatchdogEndpoint(Client& client, std::string name);

  /// Alive. `pressed`: of a pedal, and then always; false cuts the force at the next tick, and if the call is
  /// not answered within 5 ms it stops by the daemon's stop port as well (then the fault is `stopped`).
  /// Throws Error; refused: NOT_FOUND (no such endpoint), BUSY (another sender is alive under this name),
  /// INVALID (a pedal must say whether it is pressed). After an Error the next call begins afresh.
  void check_in(std::optional<bool> pressed = std::nullopt);

  /// Time from a check-in until this endpoint is missing; zero before the first one.
  std::chrono::nanoseconds timeout() const noexcept { return timeout_; }
  /// How long to wait until the next check-in: a quarter of timeout(), so that some may come late.
  std::chrono::nanoseconds pause() const noexcept { return timeout_ / 4; }

 private:
  void begin(v1::CheckInRequest request);

  Client& client_;
  std::string name_;
  std::uint64_t sender_;
  std::uint64_t nonce_ = 0;  ///< of the last answer; 0 = none
  std::chrono::nanoseconds timeout_{0};
};

}  // namespace hapticd::client
