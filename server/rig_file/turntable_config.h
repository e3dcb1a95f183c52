#pragma once

#include <cstdint>
#include <string>

#include "hal/modbus/modbus_turntable.h"
#include "hal/sim/simulated_turntable.h"
#include "hal/turntable/driven_turntable.h"

namespace hapticd::server {

enum class TurntableChoice : std::uint8_t { kNone, kSimulated, kModbus };

/// When the table must not turn.
struct InterlockConfig {
  /// Force on the tool from which it counts as touching something, whether or not a scene watches contact.
  double contact_force_n = 0.5;
  /// Force of the device from which it counts as rendering.
  double device_force_n = 0.05;
  /// Turn although no force sensor says whether the tool touches anything.
  bool turn_without_sensor = false;
  /// A sensor, and a loop, that are silent for longer than this watch nothing.
  double sensor_silence_s = 0.1;
  double loop_silence_s = 0.25;
};

/// [rig.turntable]
struct TurntableConfig {
  TurntableChoice kind = TurntableChoice::kNone;
  turntable::TurntableSettings settings;
  InterlockConfig interlock;
  sim::SimulatedTurntableConfig sim;
  modbus::ModbusConfig modbus;      ///< its map is found when the file is read
  std::string map = "plain_drive";  ///< name or path of the register map; empty = given in the file itself
};

}  // namespace hapticd::server
