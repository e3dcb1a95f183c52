#pragma once

#include <memory>
#include <string>

#include "hal/error.h"
#include "hal/modbus/modbus_link.h"
#include "hal/modbus/register_map.h"
#include "hal/modbus/units.h"
#include "hal/turntable/driven_turntable.h"

namespace hapticd::modbus {

/// A turntable's motor drive behind Modbus.
struct ModbusConfig {
  LinkConfig link;
  Gear gear;
  RegisterMap map;
};

/// Contradictions within the configuration are reported here; whether the drive is there is reported by
/// engage().
hal::Result<std::unique_ptr<hal::Turntable>> create(const ModbusConfig& config,
                                                    const turntable::TurntableSettings& settings);

}  // namespace hapticd::modbus
