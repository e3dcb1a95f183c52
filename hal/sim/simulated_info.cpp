#include "hal/sim/simulated_info.h"

#include <iterator>
#include <utility>
#include <vector>

#include "hal/sim/object/general_object_model.h"
#include "hal/sim/sensor/external_instrument.h"

namespace hapticd::sim {

hal::RigInfo info_of(const SimulationConfig& config, const DeviceModel& device, Plant plant,
                     const Conditions& conditions, const hal::SensorInfo& sensor) {
  hal::RigInfo info;
  info.kind = hal::RigKind::kSimulated;
  info.name = "sim:" + device.name;
  info.rate_hz = config.rate_hz;
  info.device = device.info();
  info.sensor = sensor;
  info.sensor.tool_mass_g = config.tool_mass_g;
  info.has_truth = true;
  info.has_external_position = true;
  const auto add = [&info](std::vector<hal::UncertainParameter> more) {
    std::move(more.begin(), more.end(), std::back_inserter(info.uncertain));
  };
  add(device.uncertain());
  add(uncertain_of(plant));
  if (config.external_instrument) add(ExternalInstrumentModel{}.uncertain());
  add(uncertain(conditions));
  return info;
}

}  // namespace hapticd::sim
