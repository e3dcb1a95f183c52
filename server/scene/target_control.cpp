#include "server/scene/target_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "rt/target/desired_force.h"
#include "rt/target/feasible_range.h"
#include "rt/target/largest_target.h"
#include "server/scene/scene_file.h"
#include "server/text/range.h"

namespace hapticd::server {

namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr Range kTargetStiffness{0.0, 1000.0, "N/mm"};
constexpr Range kTargetRampS{0.0, 60.0, "s"};
constexpr Range kHandForceN{-100.0, 100.0, "N"};
constexpr nanoseconds kFurthestAhead = std::chrono::seconds{60};
/// How long before its time a target is handed to the loop: longer than any expected stall of this thread.
/// Until then it waits outside, where it can be withdrawn at once and uses no slot of the loop.
constexpr milliseconds kHandOver{100};
constexpr milliseconds kTargetPollInterval{20};

Refusal refuse(const hal::Error& error, double value) {
  return {std::isfinite(value) ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument, error};
}

/// Sum over all numbers of the law: finite only if all of them are.
double sum_of(const rt::TargetLaw& law) {
  double sum = law.hunt_crossley.stiffness_n_per_mm_m + law.hunt_crossley.damping_n_s_per_mm_m1 +
               law.hunt_crossley.exponent + law.axis.x + law.axis.y + law.axis.z;
  for (const rt::TargetLaw::Knot& knot : law.knots) sum += knot.at_mm + knot.stiffness_n_per_mm;
  return sum;
}

/// Checks the law and normalises it.
std::optional<Refusal> validate(rt::TargetLaw& law) {
  if (law.kind == rt::TargetLaw::Kind::kLinear) {
    if (auto error = check(law.stiffness_n_per_mm, kTargetStiffness, "target stiffness",
                           "SetTargetRequest.stiffness_n_per_mm")) {
      return refuse(*error, law.stiffness_n_per_mm);
    }
    return std::nullopt;
  }
  const double sum = sum_of(law);
  if (auto error = rt::check(law, "SetTargetRequest.law")) return refuse(*error, sum);
  return std::nullopt;
}

/// Grants the part of a law that a scene admits.
Outcome<TargetSet> grant_law(const rt::TargetLaw& law, const ResolvedScene& scene, const hal::RigInfo& rig) {
  const rt::SceneSpec& resolved = scene.spec;
  if (resolved.kind == rt::SceneKind::kExplore && !resolved.explore.modulated) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {fmt::format("scene '{}' leaves the object as stiff as it is", resolved.name),
                    "SetTargetRequest.law", "", "a scene whose target.modulated is true",
                    "load such a scene, or set target.modulated = true in this one"},
                   Reason::kNotInThisScene};
  }
  TargetSet set;
  set.requested_n_per_mm = rt::greatest_stiffness_n_per_mm(law, rt::kMaxTargetDepthMm);
  if (law.kind == rt::TargetLaw::Kind::kLinear) {
    set.grant = grant_target(law.stiffness_n_per_mm, resolved, rig.device);
    if (const rt::ObjectModel* object = scene.object_model())
      add_too_soft_note(set.grant, *object, resolved, rig);
    return set;
  }
  if (resolved.kind == rt::SceneKind::kTap1d) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"scenes of kind tap_1d render linear targets only", "SetTargetRequest.law",
                    std::string(word_of(law.kind)), "linear_n_per_mm",
                    "load a scene of kind \"explore\" or \"wall\", or set a linear target"},
                   Reason::kNotInThisScene};
  }
  if (set.requested_n_per_mm > resolved.max_target_stiffness_n_per_mm) {
    return Refusal{RefusalKind::kOutOfRange,
                   {"the target law is stiffer than the scene allows", "SetTargetRequest.law",
                    to_text(set.requested_n_per_mm, "N/mm"),
                    fmt::format("at most {} down to {:g} mm in scene '{}'",
                                to_text(resolved.max_target_stiffness_n_per_mm, "N/mm"),
                                rt::kMaxTargetDepthMm, resolved.name),
                    "ask for less: only a linear target can be granted in part"}};
  }
  set.grant.granted_n_per_mm = set.requested_n_per_mm;
  return set;
}

std::optional<Refusal> validate(const TargetRequest& request, std::int64_t now_ns) {
  if (request.ramp_s) {
    if (auto error = check(*request.ramp_s, kTargetRampS, "ramp", "SetTargetRequest.ramp_s")) {
      return refuse(*error, *request.ramp_s);
    }
  }
  if (request.at_time_ns != 0 && request.at_time_ns <= now_ns) {
    return Refusal{
        RefusalKind::kOutOfRange,
        {"the time has passed", "SetTargetRequest.at_time_ns",
         fmt::format("{:.6f} s of the rig's clock, which shows {:.6f} s",
                     1e-9 * static_cast<double>(request.at_time_ns), 1e-9 * static_cast<double>(now_ns)),
         "0 for now, or up to 60 s ahead of RigState.time_ns", "send it earlier, or leave it out"}};
  }
  if (request.at_time_ns > now_ns && request.at_time_ns - now_ns > kFurthestAhead.count()) {
    return Refusal{RefusalKind::kOutOfRange,
                   {"the time lies too far ahead", "SetTargetRequest.at_time_ns",
                    fmt::format("{} s ahead", static_cast<double>(request.at_time_ns - now_ns) * 1e-9),
                    "at most 60 s ahead of RigState.time_ns", "send it later"}};
  }
  return std::nullopt;
}

/// One waiting call; counted for as long as this object lives.
class Waiting {
 public:
  explicit Waiting(std::atomic<int>& count) : count_(count), position_(count.fetch_add(1) + 1) {}
  ~Waiting() { count_.fetch_sub(1); }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  int position() const { return position_; }

 private:
  std::atomic<int>& count_;
  int position_;
};

Refusal no_scene() {
  return {RefusalKind::kFailedPrecondition,
          {"no scene is loaded", "scene", "", "", "load one first (SceneService.LoadScene)"},
          Reason::kNoScene};
}

/// Why the largest target is what it is, if it is for the device's mode; empty if it is not.
std::string for_the_mode(const rt::SceneSpec& resolved, const hal::DeviceInfo& device) {
  const double largest = rt::largest_target_n_per_mm(device);
  const bool is_for_it = resolved.kind != rt::SceneKind::kWall && largest < rt::kMaxTargetNPerMm &&
                         resolved.max_target_stiffness_n_per_mm == largest;
  if (!is_for_it) return "";
  if (device.structural_mode_hz > 0.0) {
    return fmt::format(", as the structure of {} swings at {:g} Hz, less than {:g} Hz", device.model,
                       device.structural_mode_hz, rt::kStillModeHz);
  }
  return fmt::format(
      ", as the mode of {}'s structure is not known: measure it and state structural_mode_hz in the rig's "
      "configuration (from {:g} Hz on the maximum is {:g} N/mm)",
      device.model, rt::kStillModeHz, rt::kMaxTargetNPerMm);
}

Refusal not_in_contact(std::string_view field) {
  return {RefusalKind::kFailedPrecondition,
          {"not in contact: there is nothing to take the value from",
           fmt::format("GetFeasibleRangeRequest.{}", field), "", "", "press the object, or give the value"},
          Reason::kNotInContact};
}

}  // namespace

TargetGrant grant_target(double requested_n_per_mm, const rt::SceneSpec& resolved,
                         const hal::DeviceInfo& device) {
  TargetGrant grant;
  grant.granted_n_per_mm = requested_n_per_mm;
  if (grant.granted_n_per_mm > resolved.max_target_stiffness_n_per_mm) {
    grant.granted_n_per_mm = resolved.max_target_stiffness_n_per_mm;
    grant.reason = LimitingReason::kSceneMaximum;
    grant.explanation =
        fmt::format("{:g} N/mm requested; scene '{}' allows at most {:g} N/mm{}", requested_n_per_mm,
                    resolved.name, grant.granted_n_per_mm, for_the_mode(resolved, device));
  }
  const double structural_limit = rt::kMaxCompensableRatio * rt::softest_structure_n_per_mm(resolved);
  const bool solved_for_force = resolved.structural_compensation && resolved.kind != rt::SceneKind::kExplore;
  if (solved_for_force && grant.granted_n_per_mm > structural_limit) {
    grant.granted_n_per_mm = structural_limit;
    grant.reason = LimitingReason::kStructuralStiffness;
    grant.explanation = fmt::format(
        "{:g} N/mm requested; {:g} of the device's structural stiffness of {:g} N/mm can be compensated",
        requested_n_per_mm, rt::kMaxCompensableRatio, rt::softest_structure_n_per_mm(resolved));
  }
  return grant;
}

void add_too_soft_note(TargetGrant& grant, const rt::ObjectModel& object, const rt::SceneSpec& resolved,
                       const hal::RigInfo& rig) {
  const rt::DeviceReach reach = rt::device_reach(resolved.guard.max_force_n, rig);
  const auto range = rt::feasible_range(object, rt::kFirmPressN, reach);
  if (!range || !(grant.granted_n_per_mm < range->min_n_per_mm)) return;
  grant.reason = LimitingReason::kDeviceForce;
  if (!grant.explanation.empty()) grant.explanation += "; ";
  grant.explanation += fmt::format(
      "{:.3g} N/mm granted; pressed with {:g} N '{}' feels no softer than {:.3g} N/mm, for the "
      "device pulls with no more than {:.3g} N{} (3.8)",
      grant.granted_n_per_mm, rt::kFirmPressN, object.name, range->min_n_per_mm, reach.pull_n,
      reach.pull_n < reach.push_n ? fmt::format(", {:g} of the sensor's range", rt::kMaxPullOfSensor) : "");
}

std::optional<Refusal> TargetControl::wait_until_near(std::int64_t time_ns, Caller::Clock::time_point until,
                                                      const Caller& caller) {
  // A rig with its own clock may pass any time between two polls; there the loop itself waits for the tick.
  while (!session_.rig_owns_clock() && time_ns - session_.now_ns() > nanoseconds(kHandOver).count()) {
    if (auto refusal = session_.unavailable()) return refusal;
    if (auto refusal = caller.lost()) return refusal;
    if (caller.cancelled()) {
      return Refusal{RefusalKind::kCancelled,
                     {"the caller went away; the target is withdrawn", "SetTarget", "", "", ""}};
    }
    if (Caller::Clock::now() >= until) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"the deadline passed before the target's time; it is withdrawn", "SetTarget", "", "",
                      "set a deadline beyond at_time_ns"}};
    }
    std::this_thread::sleep_for(kTargetPollInterval);
  }
  return std::nullopt;
}

void TargetControl::lengthen_ramp(const rt::TargetLaw& law, const rt::SceneSpec& scene,
                                  TargetSet& set) const {
  const double wanted_s = set.ramp_s;
  double min_s = ceilings_.min_target_ramp_s;
  std::string why = fmt::format("[guard] min_target_ramp_s = {:g} s", min_s);
  const rt::TickRecord now = hub_.latest();
  constexpr std::uint32_t kNeeded = rt::channel::kDeformation | rt::channel::kTarget;
  if ((now.channels & kNeeded) == kNeeded && now.displacement_mm > 0.0) {
    // For a law that is not linear the whole force counts as the change, its upper bound.
    const double now_n_per_mm = now.target_stiffness_n_per_mm;
    const double change_n_per_mm =
        law.kind == rt::TargetLaw::Kind::kLinear
            ? std::abs(law.stiffness_n_per_mm - now_n_per_mm)
            : std::max(rt::greatest_stiffness_n_per_mm(law, rt::kMaxTargetDepthMm), now_n_per_mm);
    // Its damping counts at the speed of a brisk press, or the present one.
    constexpr double kPressMmPerS = 100.0;
    const double speed_mm_per_s = std::max(kPressMmPerS, std::abs(now.velocity_mm_per_s));
    const double change_n = change_n_per_mm * now.displacement_mm +
                            std::max(rt::damping_n_s_per_mm(law, now.displacement_mm),
                                     rt::damping_n_s_per_mm(scenes_.in_force().target, now.displacement_mm)) *
                                speed_mm_per_s;
    if (const double needed_s = change_n / scene.max_target_change_n_per_s; needed_s > min_s) {
      min_s = needed_s;
      why =
          fmt::format("target.max_change_n_per_s = {:g} N/s, and at {:.3g} mm the force changes by {:.3g} N",
                      scene.max_target_change_n_per_s, now.displacement_mm, change_n);
    }
  }
  min_s = std::min(min_s, kTargetRampS.max);
  if (wanted_s >= min_s) return;
  set.ramp_s = min_s;
  std::string& said = set.grant.explanation;
  if (!said.empty()) said += "; ";
  said += fmt::format("the ramp of {:g} s was lengthened to {:.3g} s: {}", wanted_s, min_s, why);
}

Outcome<TargetSet> TargetControl::set(const TargetRequest& request, const Caller& caller) {
  const std::int64_t now_ns = session_.now_ns();
  rt::TargetLaw law = request.law;
  if (auto refusal = validate(law)) return *refusal;
  if (auto refusal = validate(request, now_ns)) return *refusal;
  if (auto refusal = session_.unavailable()) return *refusal;
  if (auto refusal = scenes_.reserved()) return *refusal;
  const auto scene = scenes_.current();
  if (!scene) return no_scene();
  Outcome<TargetSet> result = grant_law(law, *scene, session_.rig_info());
  if (!result) return result;
  if (law.kind == rt::TargetLaw::Kind::kLinear) law.stiffness_n_per_mm = result->grant.granted_n_per_mm;

  const Waiting waiting(waiting_);
  const bool later = request.at_time_ns > now_ns;
  if (later && waiting.position() > kMaxWaiting) {
    return Refusal{RefusalKind::kResourceExhausted,
                   {"too many targets wait for their time", "SetTargetRequest.at_time_ns", "",
                    fmt::format("{} at once", kMaxWaiting), "send it later"}};
  }
  const nanoseconds lead{later ? request.at_time_ns - now_ns : 0};
  const auto until = caller.until(lead + kDefaultTimeout);
  if (later) {
    if (auto refusal = wait_until_near(request.at_time_ns, until, caller)) return *refusal;
  }

  const SceneHost::Hold hold = scenes_.hold(until);
  if (!hold.held()) {
    return Refusal{RefusalKind::kDeadlineExceeded,
                   {"a scene is being loaded; the target is withdrawn", "scene", "", "", "try again"}};
  }
  if (scenes_.current() != scene) {
    return Refusal{RefusalKind::kAborted,
                   {"another scene was loaded while the target waited; it is withdrawn", "scene",
                    scene->spec.name, "", "set the target again"}};
  }
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kSetTarget;
  command.at_time_ns = request.at_time_ns;
  command.target = law;
  result->ramp_s = request.ramp_s.value_or(scene->spec.target_ramp_s);
  lengthen_ramp(law, scene->spec, *result);
  command.ramp_s = result->ramp_s;
  const auto outcome = session_.execute(command, caller, until - Caller::Clock::now());
  if (!outcome) return outcome.refusal();
  scenes_.note_target(law, outcome->tick);
  result->effective_tick = outcome->tick;
  result->effective_time_ns = outcome->time_ns;
  return result;
}

Outcome<Feasibility> TargetControl::feasible(std::optional<double> hand_force_n,
                                             std::optional<double> object_stiffness_n_per_mm,
                                             const rt::TickRecord& last) const {
  Feasibility result;
  const auto scene = scenes_.current();
  result.device_max_force_n = scene ? scene->spec.guard.max_force_n : session_.rig_info().device.max_force_n;

  constexpr std::uint32_t kNeeded = rt::channel::kContact | rt::channel::kDeformation | rt::channel::kControl;
  const bool in_contact = (last.channels & kNeeded) == kNeeded && last.in_contact;
  if (hand_force_n) {
    if (auto error =
            check(*hand_force_n, kHandForceN, "hand force", "GetFeasibleRangeRequest.hand_force_n")) {
      return refuse(*error, *hand_force_n);
    }
    result.hand_force_n = *hand_force_n;
  } else {
    if (!scene) return no_scene();  // without a scene there is no contact, however firmly it is pressed
    if (!in_contact) return not_in_contact("hand_force_n");
    result.hand_force_n = last.hand_force_n;
  }
  if (object_stiffness_n_per_mm) {
    if (auto error = check(*object_stiffness_n_per_mm, kTargetStiffness, "object stiffness",
                           "GetFeasibleRangeRequest.object_stiffness_n_per_mm")) {
      return refuse(*error, *object_stiffness_n_per_mm);
    }
    result.object_stiffness_n_per_mm = *object_stiffness_n_per_mm;
  } else {
    if (!scene) return no_scene();
    if (!in_contact || !(last.displacement_mm > 0.0) || !(last.reaction_force_n > 0.0)) {
      return not_in_contact("object_stiffness_n_per_mm");
    }
    result.object_stiffness_n_per_mm = last.reaction_force_n / last.displacement_mm;
  }

  const rt::DeviceReach reach = rt::device_reach(result.device_max_force_n, session_.rig_info());
  rt::FeasibleRange range = rt::feasible_range(result.object_stiffness_n_per_mm, result.hand_force_n, reach);
  // A client's value for the object is used as given. For the object under the tip its law is more exact than
  // the present depth.
  if (const rt::ObjectModel* object = scene ? scene->object_model() : nullptr;
      object != nullptr && !object_stiffness_n_per_mm) {
    range = rt::feasible_range(*object, result.hand_force_n, reach).value_or(range);
  }
  result.min_n_per_mm = range.min_n_per_mm;
  result.max_n_per_mm = range.max_n_per_mm;
  result.max_limited_by =
      std::isfinite(range.max_n_per_mm) ? LimitingReason::kDeviceForce : LimitingReason::kNone;
  if (scene) {
    const TargetGrant grant = grant_target(range.max_n_per_mm, scene->spec, session_.rig_info().device);
    if (grant.reason != LimitingReason::kNone) {
      result.max_n_per_mm = grant.granted_n_per_mm;
      result.max_limited_by = grant.reason;
    }
  }
  return result;
}

}  // namespace hapticd::server
