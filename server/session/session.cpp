#include "server/session/session.h"

#include <algorithm>
#include <utility>

#include "hal/composed_rig.h"
#include "hal/sim/simulated_rig.h"

namespace hapticd::server {

namespace {

// A command waits in slices this long, so that the end of the caller or of the service is noticed.
constexpr std::chrono::milliseconds kSlice{250};

sim::SimulatedRig* simulated_part(hal::Rig* rig) {
  if (auto* composed = dynamic_cast<hal::ComposedRig*>(rig)) rig = composed->base();
  return dynamic_cast<sim::SimulatedRig*>(rig);
}

}  // namespace

Session::Session(std::unique_ptr<hal::Rig> rig, const rt::LoopConfig& loop)
    : rig_(std::move(rig)),
      simulation_(simulated_part(rig_.get())),
      engine_(*rig_),
      loop_config_(loop),
      loop_(*rig_, engine_, loop) {}

Session::~Session() {
  stop();
}

void Session::start() {
  loop_.start();
  started_.store(true);
}

void Session::refuse_commands() {
  stopping_.store(true);
}

void Session::stop() {
  refuse_commands();
  loop_.stop();
  {
    const MutexLock lock(hardware_);
    if (!std::exchange(sensor_is_shut_, true)) rig_->disengage(hal::RigPartKind::kForceSensor);
  }
  rig_->disengage(hal::RigPartKind::kDevice);
}

SensorClaim::~SensorClaim() {
  if (session_ != nullptr) session_->release_sensor();
}

hal::Result<SensorClaim> Session::claim_sensor() {
  const MutexLock lock(hardware_);
  if (sensor_is_shut_) {
    return hal::Error{"the service is shutting down", "force sensor", "", "", "connect again later"};
  }
  if (auto error = rig_->engage(hal::RigPartKind::kForceSensor)) return std::move(*error);
  ++sensor_claims_;
  return SensorClaim(*this);
}

void Session::release_sensor() {
  const MutexLock lock(hardware_);
  if (--sensor_claims_ == 0 && !sensor_is_shut_) rig_->disengage(hal::RigPartKind::kForceSensor);
}

Session::Probe Session::probe_parts() {
  Probe probe;
  const auto claim = claim_sensor();
  if (!claim) probe.error = claim.error();
  probe.reports = rig_->reports();
  return probe;
}

std::optional<Refusal> Session::refuse_in_contact(const char* action) const {
  if (engine_.can_exchange_scene()) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {std::string("the tool is in contact: it cannot be ") + action, "rig", "", "",
                  "lift the tool and let it rest, then try again"},
                 Reason::kInContact};
}

std::optional<Refusal> Session::bias_force_sensor(const Callback<std::optional<Refusal>()>& forbidden) {
  if (auto refusal = refuse_in_contact("biased")) return refusal;
  const auto claim = claim_sensor();
  if (!claim) return Refusal{RefusalKind::kFailedPrecondition, claim.error()};
  const MutexLock lock(hardware_);
  if (auto refusal = forbidden()) return refusal;
  if (auto error = rig_->bias_force_sensor()) {
    return Refusal{RefusalKind::kFailedPrecondition, std::move(*error)};
  }
  return std::nullopt;
}

std::optional<Refusal> Session::home_device() {
  if (auto refusal = refuse_in_contact("homed")) return refusal;
  if (auto error = rig_->home_device()) return Refusal{RefusalKind::kFailedPrecondition, std::move(*error)};
  return std::nullopt;
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
                    "start the daemon again, or with loop = true in [rig.replay]"},
                   Reason::kRecordingEnded};
  }
  return std::nullopt;
}

Outcome<rt::EngineOutcome> Session::execute(rt::EngineCommand command, const Caller& caller,
                                            std::chrono::nanoseconds allowance) {
  using Status = rt::EngineOutcome::Status;
  const auto until = caller.until(allowance);
  command.lease = caller.lease;
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
                       {"no scene is loaded", "scene", "", "", "load one first (SceneService.LoadScene)"},
                       Reason::kNoScene};
      case Status::kNoWatch:
        return Refusal{RefusalKind::kFailedPrecondition,
                       {"the scene watches no presentation, or none is under way", "scene", "",
                        "a scene with a section [watch]", "load one, then begin a presentation"},
                       Reason::kNotInThisScene};
      case Status::kFaultPersists:
        return Refusal{RefusalKind::kFailedPrecondition,
                       {"the fault persists", "guard", "", "", "fix its cause, then clear again"},
                       Reason::kFaultPersists};
      case Status::kLeaseLost:
        if (auto refusal = caller.lost()) return *refusal;
        return Refusal{RefusalKind::kAborted,
                       {"control changed hands before the command took effect", "lease", "", "",
                        "acquire the lease, then send it again"},
                       Reason::kLeaseLost};
      case Status::kQueueFull:
        return Refusal{RefusalKind::kResourceExhausted,
                       {"too many commands under way", "loop", "",
                        std::to_string(rt::Engine::kCommandSlots) + " at once", "wait for some to finish"}};
    }
  }
}

}  // namespace hapticd::server
