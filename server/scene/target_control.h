#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "rt/record/tick_record.h"
#include "rt/scene/scene_spec.h"
#include "server/config/guard_ceilings.h"
#include "server/scene/scene_host.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Why a request was not granted in full.
enum class LimitingReason : std::uint8_t { kNone, kSceneMaximum, kStructuralStiffness, kDeviceForce };

/// The part of a requested stiffness that a scene can render.
struct TargetGrant {
  double granted_n_per_mm = 0.0;
  LimitingReason reason = LimitingReason::kNone;
  std::string explanation;  ///< as text, with the numbers; empty when nothing was limited
};

/// min(requested, the scene's maximum, the compensable part of the structural stiffness). The last limits
/// only scenes that solve the compensation for the device force: those along one axis.
TargetGrant grant_target(double requested_n_per_mm, const rt::SceneSpec& resolved,
                         const hal::DeviceInfo& device);

/// Adds a note if the granted stiffness is softer than feasible, (3.8), on this object under a firm press
/// (kFirmPressN), by its identified law and with the greatest pull that the device has and the sensor bears.
/// It stays granted: under a lighter press softer targets are feasible; under a firmer one the device
/// constantly gives its greatest force and the object feels stiffer than requested.
void add_too_soft_note(TargetGrant& grant, const rt::ObjectModel& object, const rt::SceneSpec& resolved,
                       const hal::RigInfo& rig);

/// Range of (3.8), limited to what the loaded scene would grant.
struct Feasibility {
  double hand_force_n = 0.0;
  double object_stiffness_n_per_mm = 0.0;
  double min_n_per_mm = 0.0;
  double max_n_per_mm = 0.0;
  LimitingReason max_limited_by = LimitingReason::kNone;
  double device_max_force_n = 0.0;
};

struct TargetRequest {
  rt::TargetLaw law;            ///< granted in part only if it is linear
  std::int64_t at_time_ns = 0;  ///< of the rig's clock; 0 = now
  std::optional<double> ramp_s;
};

struct TargetSet {
  double requested_n_per_mm = 0.0;  ///< for a law that is not linear: its greatest stiffness
  TargetGrant grant;
  std::uint64_t effective_tick = 0;
  std::int64_t effective_time_ns = 0;
  double ramp_s = 0.0;  ///< as requested, or longer
};

/// Sets targets, now or at a given time, and says what could be rendered.
class TargetControl {
 public:
  /// Targets that may wait for their time at once. More are refused, so that waiting targets never use up the
  /// slots that a clear or a scene needs.
  static constexpr int kMaxWaiting = 16;

  TargetControl(Session& session, SceneHost& scenes, TelemetryHub& hub, const GuardCeilings& ceilings)
      : session_(session), scenes_(scenes), hub_(hub), ceilings_(ceilings) {}

  /// Returns when it has taken effect. It is withdrawn when the caller leaves, its deadline passes, or
  /// another scene is loaded meanwhile.
  Outcome<TargetSet> set(const TargetRequest& request, const Caller& caller);

  /// Feasibility; absent values are taken from `last`, which must then be in contact.
  Outcome<Feasibility> feasible(std::optional<double> hand_force_n,
                                std::optional<double> object_stiffness_n_per_mm,
                                const rt::TickRecord& last) const;

 private:
  std::optional<Refusal> wait_until_near(std::int64_t time_ns, Caller::Clock::time_point until,
                                         const Caller& caller);

  /// Lengthens a ramp that is shorter than the ceilings allow for this change of the target at the present
  /// displacement, and says so.
  void lengthen_ramp(const rt::TargetLaw& law, const rt::SceneSpec& scene, TargetSet& set) const;

  Session& session_;
  SceneHost& scenes_;
  TelemetryHub& hub_;
  const GuardCeilings ceilings_;
  std::atomic<int> waiting_{0};
};

}  // namespace hapticd::server
