#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "hal/lock/callback.h"
#include "rt/record/tick_record.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Stop and clear. Any client may stop, at any time, without waiting.
class SafetyLatch {
 public:
  SafetyLatch(Session& session, TelemetryHub& hub) : session_(session), hub_(hub) {}

  /// `explain`: what is known about a fault beyond its line in the table, e.g. who is missing; may be empty.
  /// To be set before anyone clears.
  void explain_with(Callback<std::string(rt::GuardFault)> explain) { explain_ = std::move(explain); }

  /// Stops: zero force from the next tick. Returns the last tick that was completed when the loop got the
  /// stop: by the second one after it the force is zero. Waits for nothing, cannot fail.
  std::uint64_t stop() noexcept;
  /// Fault that the guard is latched by after a stop: an earlier one stays the one reported.
  rt::GuardFault fault_after_stop();
  /// Ends rendering before the loop ends: returns when the zero force was commanded, or after a short time
  /// without a tick.
  void end_rendering();

  struct Cleared {
    rt::GuardState state = rt::GuardState::kRendering;
    rt::GuardFault fault = rt::GuardFault::kNone;  ///< what was cleared
    std::uint64_t effective_tick = 0;
  };
  /// Sets what each clear() that took effect calls. Set it before there are callers.
  void on_cleared(Callback<void()> cleared) { on_cleared_ = std::move(cleared); }
  /// Clears; refused while the fault persists.
  Outcome<Cleared> clear(const Caller& caller);

 private:
  Session& session_;
  TelemetryHub& hub_;
  Callback<std::string(rt::GuardFault)> explain_ = [](rt::GuardFault) { return std::string(); };
  Callback<void()> on_cleared_;
  std::atomic<bool> stopped_{false};          ///< since the last clear
  std::atomic<std::uint64_t> stopped_by_{0};  ///< the loop knows of it by this tick
};

}  // namespace hapticd::server
