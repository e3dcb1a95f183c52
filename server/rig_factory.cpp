#include "server/rig_factory.h"

#include <utility>

namespace hapticd::server {

namespace {

template <class R>
hal::Result<std::unique_ptr<hal::Rig>> as_rig(hal::Result<std::unique_ptr<R>> opened) {
  if (!opened) return opened.error();
  return std::unique_ptr<hal::Rig>(std::move(*opened));
}

}  // namespace

hal::Result<std::unique_ptr<hal::Rig>> open_rig(const DaemonConfig& config) {
  switch (config.rig) {
    case RigChoice::kSimulated:
      return as_rig(sim::SimulatedRig::create(config.simulation));
    case RigChoice::kReplay:
      return as_rig(replay::ReplayRig::open(config.replay));
  }
  return hal::Error{"unknown kind of rig", "[rig] kind", "", "sim, replay", ""};
}

}  // namespace hapticd::server
