#pragma once

#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/safety.pb.h"
#include "hapticd/v1/telemetry.pb.h"
#include "rt/guard/fault_table.h"
#include "rt/record/tick_record.h"

namespace hapticd::server {

// The contract's enums begin with an unspecified 0; then they have the values of the tick's enums, plus one.

constexpr v1::GuardState to_proto(rt::GuardState state) {
  return static_cast<v1::GuardState>(static_cast<int>(state) + 1);
}
static_assert(to_proto(rt::GuardState::kRendering) == v1::GUARD_STATE_RENDERING);
static_assert(to_proto(rt::GuardState::kSuspended) == v1::GUARD_STATE_SUSPENDED);

constexpr v1::GuardFault to_proto(rt::GuardFault fault) {
  return static_cast<v1::GuardFault>(static_cast<int>(fault) + 1);
}
static_assert(to_proto(rt::GuardFault::kNone) == v1::GUARD_FAULT_NONE);
static_assert(to_proto(rt::GuardFault::kSensorStale) == v1::GUARD_FAULT_SENSOR_STALE);
static_assert(to_proto(rt::GuardFault::kTurntableAlarm) == v1::GUARD_FAULT_TURNTABLE_ALARM);
static_assert(to_proto(rt::GuardFault::kOscillation) == v1::GUARD_FAULT_OSCILLATION);
static_assert(to_proto(rt::GuardFault::kSensorZeroLost) == v1::GUARD_FAULT_SENSOR_ZERO_LOST);
static_assert(to_proto(rt::GuardFault::kClientLost) == v1::GUARD_FAULT_CLIENT_LOST);
static_assert(to_proto(rt::GuardFault::kUncleanEnd) == v1::GUARD_FAULT_UNCLEAN_END);
static_assert(to_proto(rt::GuardFault::kStructureSwings) == v1::GUARD_FAULT_STRUCTURE_SWINGS);

constexpr v1::FaultAction to_proto(rt::FaultAction action) {
  return static_cast<v1::FaultAction>(static_cast<int>(action) + 1);
}
static_assert(to_proto(rt::FaultAction::kCut) == v1::FAULT_ACTION_CUT);

constexpr v1::FaultClearing to_proto(rt::FaultClearing clearing) {
  return static_cast<v1::FaultClearing>(static_cast<int>(clearing) + 1);
}
static_assert(to_proto(rt::FaultClearing::kAnyClient) == v1::FAULT_CLEARING_ANY_CLIENT);

constexpr v1::ContactReason to_proto(rt::ContactReason reason) {
  return static_cast<v1::ContactReason>(static_cast<int>(reason) + 1);
}
static_assert(to_proto(rt::ContactReason::kAwaitingFree) == v1::CONTACT_REASON_AWAITING_FREE);
static_assert(to_proto(rt::ContactReason::kAboveSurface) == v1::CONTACT_REASON_ABOVE_SURFACE);
static_assert(to_proto(rt::ContactReason::kWithdrawn) == v1::CONTACT_REASON_WITHDRAWN);

constexpr v1::OverrunCause to_proto(rt::OverrunCause cause) {
  return static_cast<v1::OverrunCause>(static_cast<int>(cause) + 1);
}
static_assert(to_proto(rt::OverrunCause::kNone) == v1::OVERRUN_CAUSE_NONE);
static_assert(to_proto(rt::OverrunCause::kDevice) == v1::OVERRUN_CAUSE_DEVICE);

/// The channel bit of a field group other than UNSPECIFIED.
constexpr std::uint32_t channel_of(v1::FieldGroup group) {
  return 1U << (static_cast<unsigned>(group) - 1U);
}
static_assert(channel_of(v1::FIELD_GROUP_SAMPLE) == rt::channel::kSample);
static_assert(channel_of(v1::FIELD_GROUP_CONTACT) == rt::channel::kContact);
static_assert(channel_of(v1::FIELD_GROUP_GUARD) == rt::channel::kGuard);
static_assert(channel_of(v1::FIELD_GROUP_TRUTH) == rt::channel::kTruth);
static_assert(channel_of(v1::FIELD_GROUP_DIRECTION) == rt::channel::kDirection);
static_assert(channel_of(v1::FIELD_GROUP_PASSIVITY) == rt::channel::kPassivity);
static_assert(channel_of(v1::FIELD_GROUP_ZERO) == rt::channel::kZero);
static_assert(channel_of(v1::FIELD_GROUP_INCLUSION) == rt::channel::kInclusion);
static_assert(channel_of(v1::FIELD_GROUP_FRICTION) == rt::channel::kFriction);
static_assert(channel_of(v1::FIELD_GROUP_TRANSIENT) == rt::channel::kTransient);
static_assert(channel_of(v1::FIELD_GROUP_ANGLES) == rt::channel::kAngles);
static_assert(channel_of(v1::FIELD_GROUP_ASSIST) == rt::channel::kAssist);

}  // namespace hapticd::server
