#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// The state of the tool in one tick: whether force is rendered, whether the sensor can be trusted, whether
/// something is touched. Made from either message that has it; what a message does not have is unknown.
struct LiveState {
  bool runs = true;  ///< the loop
  bool has_scene = false;
  std::optional<bool> uses_sensor;             ///< the scene
  std::optional<v1::GuardFault> sensor_fault;  ///< present now, of those that make the force unusable
  double force_age_ms = 0.0;                   ///< of the newest sensor sample
  v1::GuardState guard = v1::GUARD_STATE_UNSPECIFIED;
  v1::GuardFault guard_fault = v1::GUARD_FAULT_UNSPECIFIED;  ///< why the guard holds the force back
  std::optional<bool> biased;                                ///< the sensor
  std::optional<bool> in_contact;
  v1::ContactReason reason = v1::CONTACT_REASON_UNSPECIFIED;
  double detection_force_n = 0.0;
  double authority = 1.0;  ///< 0 … 1: share of the force that the evidence of an object allows
};

LiveState live_state(const v1::RigState& state);
LiveState live_state(const v1::TelemetrySample& sample);

/// The most important fact, as text: first what keeps the force away, then what is touched, e.g. "no
/// fresh force: the newest is 35 ms old (sensor stale)", "waiting until nothing touches the tool: 0.12 N
/// remain; move it in free air", "in contact". Empty if the message has none of it.
std::string words(const LiveState& state);

/// How far the sensor's zero was followed since its bias, the limit, and what to do.
std::string sensor_zero_words(const v1::RigState& state);

}  // namespace hapticd::cli
