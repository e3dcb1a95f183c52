#include "server/session.h"

#include <algorithm>

#include "hal/sim/simulated_rig.h"

namespace hapticd::server {

namespace {

// A command waits in slices this long, so that a caller who leaves or a service that ends is noticed.
constexpr std::chrono::milliseconds kSlice{250};

}  // namespace

Session::Session(std::unique_ptr<hal::Rig> rig, const rt::LoopConfig& loop)
    : rig_(std::move(rig)),
      simulation_(dynamic_cast<sim::SimulatedRig*>(rig_.get())),
      engine_(*rig_),
      loop_(*rig_, engine_, loop) {}

Session::~Session() {
  stop();
}

void Session::start() {
  loop_.start();
  started_.store(true);
}

void Session::stop() {
  stopping_.store(true);
  loop_.stop();
}

std::vector<std::string> Session::realtime_shortcomings() const {
  return started_.load() ? loop_.shortcomings() : std::vector<std::string>{};
}

std::optional<Refusal> Session::unavailable() const {
  if (stopping_.load()) {
    return Refusal{RefusalKind::kUnavailable,
                   {"the service is shutting down", "loop", "", "", "connect again later"}};
  }
  if (!started_.load()) {
    return Refusal{RefusalKind::kUnavailable,
                   {"the loop has not started yet", "loop", "", "", "try again in a moment"}};
  }
  if (!loop_.running()) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"the recording has ended", "rig '" + rig_->info().name + "'", "", "",
                    "start the daemon anew, or with loop = true in [rig.replay]"}};
  }
  return std::nullopt;
}

Outcome<rt::EngineOutcome> Session::execute(const rt::EngineCommand& command, const Caller& caller,
                                            std::chrono::nanoseconds allowance) {
  using Status = rt::EngineOutcome::Status;
  const auto until = caller.until(allowance);
  for (;;) {
    if (auto refusal = unavailable()) return *refusal;
    if (caller.cancelled()) {
      return Refusal{RefusalKind::kCancelled,
                     {"the caller went away; the command is withdrawn", "loop", "", "", ""}};
    }
    const auto remaining = until - Caller::Clock::now();
    if (remaining <= std::chrono::nanoseconds::zero()) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"the loop did not take the command in time; it is withdrawn", "loop", "", "",
                      "allow more time, or see in GetRigState how the loop fares"}};
    }
    const rt::EngineOutcome outcome =
        engine_.execute(command, std::min<std::chrono::nanoseconds>(remaining, kSlice));
    switch (outcome.status) {
      case Status::kApplied:
        return outcome;
      case Status::kTimedOut:
        break;
      case Status::kNoScene:
        return Refusal{RefusalKind::kFailedPrecondition,
                       {"no scene is loaded", "scene", "", "", "load one first (SceneService.LoadScene)"}};
      case Status::kFaultPersists:
        return Refusal{RefusalKind::kFailedPrecondition,
                       {"the fault persists", "guard", "", "", "mend its cause, then clear again"}};
      case Status::kQueueFull:
        return Refusal{RefusalKind::kResourceExhausted,
                       {"too many commands under way", "loop", "",
                        std::to_string(rt::Engine::kCommandSlots) + " at once", "wait for some to finish"}};
    }
  }
}

}  // namespace hapticd::server
