#include "server/rig/rig_factory.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/composed_rig.h"
#include "hal/daq/board_factory.h"
#include "hal/daq/board_instrument.h"
#include "hal/netft/netft_sensor.h"
#include "hal/openhaptics/openhaptics_device.h"
#include "hal/phantom/phantom_device.h"
#include "hal/replay/table_file.h"
#include "server/telemetry/recording_columns.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

template <class R>
hal::Result<std::unique_ptr<hal::Rig>> as_rig(hal::Result<std::unique_ptr<R>> opened) {
  if (!opened) return opened.error();
  return std::unique_ptr<hal::Rig>(std::move(*opened));
}

/// Error for an unknown name: a simulated rig knows its own names; here a similar one is suggested.
std::optional<hal::Error> unknown(const std::string& what, const std::string& name,
                                  const std::vector<std::string>& known,
                                  const std::string& section = "rig.sim") {
  if (std::find(known.begin(), known.end(), name) != known.end()) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown " + what, "[" + section + "] " + what, name,
                        comma_separated(known), did_you_mean(name, known, "use one of those"));
}

std::optional<hal::Error> check_names(const DaemonConfig& config) {
  const sim::SimulationConfig& simulation = config.simulation;
  if (auto error = unknown("device", simulation.device, sim::SimulatedRig::device_presets())) return error;
  if (auto error = unknown("conditions", simulation.conditions, sim::condition_preset_names())) return error;
  if (auto error = unknown("tip", simulation.tip, sim::SimulatedRig::tips())) return error;
  if (auto error = unknown("plant", simulation.plant, sim::SimulatedRig::plants())) return error;
  std::vector<std::string> objects = sim::SimulatedRig::object_presets();
  objects.emplace_back("none");
  if (auto error = unknown("object", simulation.object, objects)) return error;
  for (const hal::TurntableStation& station : config.turntable.settings.stations) {
    if (station.object.empty()) continue;
    if (auto error = unknown("object", station.object, objects, "rig.turntable.stations." + station.name))
      return error;
  }
  return std::nullopt;
}

/// Opens a recording, also one of hapticd's own, whose columns have other names.
hal::Result<std::unique_ptr<hal::Rig>> open_replay(replay::ReplayConfig config) {
  const auto opened = replay::TableFile::open(config.path, {.decimal_comma = config.decimal_comma});
  if (!opened) return opened.error();
  const auto& file = *opened;
  fill_own_column(config.force, role_of(replay::Quantity::kForce), file->columns());
  fill_own_column(config.position, role_of(replay::Quantity::kPosition), file->columns());
  return as_rig(replay::ReplayRig::open(config));
}

/// Opens the rig that replaces the parts that are not named; null if there is none.
hal::Result<std::unique_ptr<hal::Rig>> open_base(const DaemonConfig& config) {
  switch (config.rig) {
    case RigChoice::kSimulated:
      if (auto error = check_names(config)) return *error;
      return as_rig(sim::SimulatedRig::create(config.simulation));
    case RigChoice::kReplay:
      return open_replay(config.replay);
    case RigChoice::kHardware:
      return std::unique_ptr<hal::Rig>();
  }
  return hal::Error{"unknown kind of rig", "[rig] kind", "", "sim, replay, hardware", ""};
}

template <class Part, class Driver>
std::optional<hal::Error> take(hal::Result<std::unique_ptr<Driver>> made, std::unique_ptr<Part>& part) {
  if (!made) return made.error();
  part = std::move(*made);
  return std::nullopt;
}

std::optional<hal::Error> make_parts(const DaemonConfig& config, hal::RigParts& parts) {
  // One board for all parts that are connected to it.
  std::shared_ptr<daq::Board> board;
  const bool has_instrument = config.instrument == InstrumentChoice::kBoard;
  if (config.device == DeviceChoice::kPhantom || config.sensor == SensorChoice::kDaq || has_instrument) {
    daq::BoardConfig wired = config.board;
    if (has_instrument) wired.spare_channels = daq::channels_of(config.board_instrument);
    auto made = daq::create_board(wired);
    if (!made) return made.error();
    board = std::move(*made);
  }
  std::optional<hal::Error> error;
  switch (config.device) {
    case DeviceChoice::kOfKind:
      break;
    case DeviceChoice::kOpenHaptics:
      error = take(openhaptics::OpenHapticsDevice::create(config.openhaptics), parts.device);
      break;
    case DeviceChoice::kPhantom:
      error = take(phantom::PhantomDevice::create(config.phantom, board), parts.device);
      break;
  }
  if (!error && has_instrument) {
    error = take(daq::BoardInstrument::create(config.board_instrument, board), parts.instrument);
  }
  if (error) return error;
  switch (config.sensor) {
    case SensorChoice::kOfKind:
      return std::nullopt;
    case SensorChoice::kNetFt:
      return take(netft::NetFtSensor::create(config.netft), parts.sensor);
    case SensorChoice::kDaq:
      return take(daq::DaqSensor::create(config.daq, board), parts.sensor);
  }
  return std::nullopt;
}

}  // namespace

hal::Result<std::unique_ptr<hal::Rig>> open_rig(const DaemonConfig& config) {
  auto base = open_base(config);
  if (!base) return base.error();
  if (config.device == DeviceChoice::kOfKind && config.sensor == SensorChoice::kOfKind) return base;
  hal::RigParts parts;
  parts.base = std::move(*base);
  if (auto error = make_parts(config, parts)) return *error;
  return std::unique_ptr<hal::Rig>(std::make_unique<hal::ComposedRig>(std::move(parts), config.loop.rate_hz));
}

std::string rig_kind_of_models(hal::RigKind kind) {
  switch (kind) {
    case hal::RigKind::kSimulated:
      return "simulated";
    case hal::RigKind::kHardware:
      return "hardware";
    case hal::RigKind::kReplay:
      break;
  }
  return {};
}

}  // namespace hapticd::server
