#pragma once

#include "hal/samples.h"
#include "rt/signal/tick_interval.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Motion of the tool and load on its sensor in one tick, rig frame.
struct ToolState {
  TickInterval interval;
  hal::Vector3 encoder_mm;       ///< the tip as the encoders report it
  hal::Vector3 encoder_step_mm;  ///< since the last tick
  hal::Vector3 tip_mm;           ///< deflection of the structure taken into account
  hal::Vector3 step_mm;          ///< of the tip since the last tick
  hal::Vector3 velocity_mm_per_s;
  hal::Vector3 acceleration_mm_per_s2;
  hal::Vector3 mass_mm;                      ///< centre of the tool's mass, by the encoders
  hal::Vector3 mass_acceleration_mm_per_s2;  ///< its acceleration
  hal::Vector3 load_n;                       ///< on the sensor, weight subtracted
  hal::Vector3 reaction_n;                   ///< on the tool
};

/// What a tick knows of the contact when forces are asked for, rig frame. All is of the present tick.
struct ContactState {
  ContactState(const ToolState& measured, const hal::Vector3& device_force_n) noexcept
      : tool(measured), device_n(device_force_n) {}

  const ToolState& tool;
  hal::Vector3 device_n;  ///< what the device gives the tip since the last tick
  bool in_contact = false;
  bool began = false;             ///< a contact began in this tick; it may have ended in it, too
  bool begins_anew = false;       ///< a contact was not held over a gap: its evidence begins again
  double earned_authority = 0.0;  ///< 0 … 1: what the evidence allows without a slope; 0 out of contact
  hal::Vector3 normal;            ///< out of the object, length 1; out of contact the last one
  hal::Vector3 friction_n;        ///< estimated, on the tool; 0 out of contact
  double normal_n = 0.0;          ///< of the reaction; 0 out of contact
  double rate_mm_per_s = 0.0;     ///< speed into the object
  bool is_rendered = false;       ///< in contact, or a release is fading
  double authority = 0.0;        ///< 0 … 1: in contact what its evidence allows, then what a release leaves
  double displacement_mm = 0.0;  ///< that is rendered, 0 or more; after a release it only shrinks
  double lead_s = 0.0;           ///< by which the displacement is taken ahead

  /// Force of the hand along the normal (4.1).
  double hand_n() const noexcept { return normal_n + dot(device_n, normal); }
};

}  // namespace hapticd::rt
