#pragma once

#include <memory>
#include <string>

#include "hal/error.h"
#include "hal/rig.h"
#include "server/config/config.h"

namespace hapticd::server {

/// Opens the rig the configuration names.
hal::Result<std::unique_ptr<hal::Rig>> open_rig(const DaemonConfig& config);

/// The kind of rig under which models are stored. The rig of a recording is not known: any model may be used.
std::string rig_kind_of_models(hal::RigKind kind);

}  // namespace hapticd::server
