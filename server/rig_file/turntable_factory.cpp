#include "server/rig_file/turntable_factory.h"

namespace hapticd::server {

hal::Result<std::unique_ptr<hal::Turntable>> make_turntable(const TurntableConfig& config) {
  switch (config.kind) {
    case TurntableChoice::kNone:
      break;
    case TurntableChoice::kSimulated:
      return sim::create_turntable(config.sim, config.settings);
    case TurntableChoice::kModbus:
      return modbus::create(config.modbus, config.settings);
  }
  return std::unique_ptr<hal::Turntable>();
}

}  // namespace hapticd::server
