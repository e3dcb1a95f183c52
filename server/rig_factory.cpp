#include "server/rig_factory.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/suggestion.h"

namespace hapticd::server {

namespace {

template <class R>
hal::Result<std::unique_ptr<hal::Rig>> as_rig(hal::Result<std::unique_ptr<R>> opened) {
  if (!opened) return opened.error();
  return std::unique_ptr<hal::Rig>(std::move(*opened));
}

/// The names that a simulated rig knows are its own; a near one is suggested here.
std::optional<hal::Error> unknown(const std::string& what, const std::string& name,
                                  std::vector<std::string> known) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return std::nullopt;
  return hal::Error{"unknown " + what, "[rig.sim] " + what, name, comma_separated(known),
                    did_you_mean(name, known, "use one of those")};
}

std::optional<hal::Error> check_names(const sim::SimulationConfig& simulation) {
  if (auto error = unknown("device", simulation.device, sim::SimulatedRig::device_presets())) return error;
  if (auto error = unknown("tip", simulation.tip, sim::SimulatedRig::tips())) return error;
  std::vector<std::string> objects = sim::SimulatedRig::object_presets();
  objects.emplace_back("none");
  return unknown("object", simulation.object, std::move(objects));
}

}  // namespace

hal::Result<std::unique_ptr<hal::Rig>> open_rig(const DaemonConfig& config) {
  switch (config.rig) {
    case RigChoice::kSimulated:
      if (auto error = check_names(config.simulation)) return *error;
      return as_rig(sim::SimulatedRig::create(config.simulation));
    case RigChoice::kReplay:
      return as_rig(replay::ReplayRig::open(config.replay));
  }
  return hal::Error{"unknown kind of rig", "[rig] kind", "", "sim, replay", ""};
}

}  // namespace hapticd::server
