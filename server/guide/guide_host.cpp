#include "server/guide/guide_host.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "hal/turntable.h"
#include "rt/assist/assistance.h"
#include "server/process/log.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/text/range.h"
#include "server/turntable/turntable_host.h"

namespace hapticd::server {

namespace {

using rt::GuideState;
using std::chrono::milliseconds;

constexpr milliseconds kLook{2};
constexpr milliseconds kProgressPeriod{100};
constexpr const char* kWho = "the guide's motion";
constexpr const char* kRequest = "MoveToolRequest";
/// Time beyond twice what the way takes.
constexpr double kSpareS = 5.0;
constexpr double kMaxReachMm = 1000.0;

Refusal refused(RefusalKind kind, hal::Error error, Reason reason = Reason::kOfKind) {
  return {kind, std::move(error), reason};
}

/// Reason why a motion that ended so is a failure; nothing if it is not one.
std::optional<hal::Error> problem_of(GuideState state) {
  const auto error = [](const char* what, const char* remedy) {
    return hal::Error{what, "guide", "", "", remedy};
  };
  switch (state) {
    case GuideState::kResisted:
      return error("the tool was held back", "hold it loosely, or allow more force");
    case GuideState::kTimedOut:
      return error("the tool did not arrive in time", "allow more time, or look what holds it back");
    case GuideState::kCancelled:
      return error("the motion was cancelled", "");
    case GuideState::kForceCut:
      return error("the guard took the force away", "fix the cause, clear it, then begin again");
    default:
      return std::nullopt;
  }
}

std::optional<Refusal> outside(double value, const Range& range, const char* what, const char* field) {
  if (auto error = check(value, range, what, std::string(kRequest) + "." + field)) {
    const bool is_finite = std::isfinite(value);
    return refused(is_finite ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument, *error);
  }
  return std::nullopt;
}

}  // namespace

Outcome<hal::Vector3> GuideHost::goal_of(const ToolDestination& destination, const rt::TickRecord& now) {
  if (destination.point_mm) {
    const hal::Vector3& p = *destination.point_mm;
    for (const double value : {p.x, p.y, p.z}) {
      if (auto refusal = outside(value, {-kMaxReachMm, kMaxReachMm, "mm"}, "the point", "point_mm"))
        return *refusal;
    }
    return p;
  }
  if (!destination.above_station.empty()) {
    if (auto refusal = turntable_.require_station(destination.above_station)) return *refusal;
    for (const hal::TurntableStation& station : turntable_.table()->info().stations) {
      if (station.name == destination.above_station) return station.tool_mm;
    }
  }
  if (destination.until_contact_mm) {
    if (auto refusal = outside(*destination.until_contact_mm, {0.0, kMaxReachMm, "mm"}, "the distance",
                               "until_contact_mm")) {
      return *refusal;
    }
    const auto scene = scenes_.current();
    if (!scene) {
      return refused(RefusalKind::kFailedPrecondition,
                     {"no scene is loaded that could notice a contact", "scene", "", "", "load one first"},
                     Reason::kNoScene);
    }
    if (now.in_contact && now.contact_authority >= rt::kEvidentAuthority) {
      return refused(RefusalKind::kFailedPrecondition,
                     {"the tool is in contact already", "guide", "", "", "lift it off the object"},
                     Reason::kInContact);
    }
    return now.tip_position_mm + scene->spec.press_axis * *destination.until_contact_mm;
  }
  return refused(RefusalKind::kInvalidArgument, {"no destination is given", kRequest, "",
                                                 "point_mm, above_station or until_contact_mm", "give one"});
}

Outcome<rt::GuideMotion> GuideHost::motion_to(const ToolDestination& destination, const rt::TickRecord& now) {
  namespace range = rt::guide_range;
  const auto goal = goal_of(destination, now);
  if (!goal) return goal.refusal();
  rt::GuideMotion motion;
  motion.goal_mm = *goal;
  motion.max_speed_mm_per_s = destination.max_speed_mm_per_s.value_or(motion.max_speed_mm_per_s);
  motion.max_force_n = destination.max_force_n.value_or(motion.max_force_n);
  if (auto refusal =
          outside(motion.max_speed_mm_per_s, {range::kMinSpeedMmPerS, range::kMaxSpeedMmPerS, "mm/s"},
                  "the speed", "max_speed_mm_per_s")) {
    return *refusal;
  }
  if (auto refusal = outside(motion.max_force_n, {range::kMinForceN, range::kMaxForceN, "N"}, "the force",
                             "max_force_n")) {
    return *refusal;
  }
  const hal::Vector3 path_mm = motion.goal_mm - now.tip_position_mm;
  const double takes_s = 2.1 * std::sqrt(dot(path_mm, path_mm)) / motion.max_speed_mm_per_s;
  motion.timeout_s = std::min(range::kMaxTimeoutS, 2.0 * takes_s + kSpareS);
  if (destination.timeout_s) {
    motion.timeout_s = *destination.timeout_s;
    if (auto refusal = outside(motion.timeout_s, {0.1, range::kMaxTimeoutS, "s"}, "the time", "timeout_s"))
      return *refusal;
  }
  return motion;
}

Outcome<GuideHost::Status> GuideHost::move(const ToolDestination& destination, const Caller& caller,
                                           const Progress& progress) {
  if (auto refusal = session_.unavailable()) return *refusal;
  const auto reservation = scenes_.reserve(kWho);
  if (!reservation) return reservation.refusal();
  const rt::TickRecord now = hub_.latest();
  if (now.guard_state == rt::GuardState::kLatched) {
    return refused(RefusalKind::kFailedPrecondition,
                   {"the guard is latched", "guard", "", "", "fix the cause, then clear it"},
                   Reason::kGuardLatched);
  }
  const auto motion = motion_to(destination, now);
  if (!motion) return motion.refusal();
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kBeginGuide;
  command.guide = *motion;
  const auto begun = session_.execute(command, caller, kDefaultTimeout);
  if (!begun) return begun.refusal();
  log_info(fmt::format("guide: motion {} begins, to ({:.1f}, {:.1f}, {:.1f}) mm", begun->guide,
                       motion->goal_mm.x, motion->goal_mm.y, motion->goal_mm.z));
  return follow(begun->guide, motion->goal_mm, caller, progress);
}

Outcome<GuideHost::Status> GuideHost::follow(std::uint32_t number, const hal::Vector3& goal_mm,
                                             const Caller& caller, const Progress& progress) {
  std::optional<Refusal> left;  // why the caller no longer waits
  auto next_progress = Caller::Clock::now();
  for (;;) {
    const Status status{hub_.latest(), goal_mm};
    const rt::TickRecord& now = status.record;
    const bool is_known = now.guide_number == number;
    const bool has_let_go = dot(now.guide_force_n, now.guide_force_n) == 0.0;
    if (is_known && now.guide_state != GuideState::kUnderWay && has_let_go) {
      const auto problem = problem_of(now.guide_state);
      log_info(fmt::format("guide: motion {} is over{}", number, problem ? ": " + problem->what : ""));
      if (!left) (void)progress(status);
      if (left) return *left;
      if (problem) return refused(RefusalKind::kAborted, *problem);
      return status;
    }
    if (auto refusal = session_.unavailable()) return *refusal;
    const auto time = Caller::Clock::now();
    if (!left) {
      const auto gone = [](const char* what, RefusalKind kind) {
        return refused(kind, {std::string(what) + "; the motion was ended", "guide", "", "", ""});
      };
      bool is_there = true;
      if (is_known && time >= next_progress) {
        next_progress = time + kProgressPeriod;
        is_there = progress(status);
      }
      if (auto lost = caller.lost()) {
        left = std::move(*lost);
        left->error.what += "; the motion was ended";
      } else if (!is_there || caller.cancelled()) {
        left = gone("the caller went away", RefusalKind::kCancelled);
      } else if (time >= caller.deadline) {
        left = gone("the caller's time is over", RefusalKind::kDeadlineExceeded);
      }
      if (left) {
        rt::EngineCommand cancel;
        cancel.kind = rt::EngineCommand::Kind::kCancelGuide;
        (void)session_.execute(cancel, Caller{}, kDefaultTimeout);
      }
    }
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace hapticd::server
