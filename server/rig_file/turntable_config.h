#pragma once

#include <cstdint>
#include <string>

#include "hal/modbus/modbus_turntable.h"
#include "hal/sim/simulated_turntable.h"
#include "hal/turntable/driven_turntable.h"

namespace hapticd::server {

enum class TurntableChoice : std::uint8_t { kNone, kSimulated, kModbus };

/// Conditions under which the table must not turn.
struct InterlockConfig {
  /// Force from which on the tool counts as touching something, whether or not a scene detects contact.
  double contact_force_n = 0.5;
  /// Force from which on the device counts as rendering.
  double device_force_n = 0.05;
  /// Turn although no force sensor says whether the tool touches anything.
  bool turn_without_sensor = false;
  /// Silence after which the sensor or the loop does not count as watching.
  double sensor_silence_s = 0.1;
  double loop_silence_s = 0.25;
};

/// [rig.turntable]
struct TurntableConfig {
  TurntableChoice kind = TurntableChoice::kNone;
  turntable::TurntableSettings settings;
  InterlockConfig interlock;
  sim::SimulatedTurntableConfig sim;
  modbus::ModbusConfig modbus;      ///< its map is looked up when the file is read
  std::string map = "plain_drive";  ///< name or path of the register map; empty = given in the file itself
};

}  // namespace hapticd::server
