#pragma once

#include <memory>

#include "hal/error.h"
#include "hal/rig.h"
#include "server/config/config.h"

namespace hapticd::server {

/// Opens the rig the configuration names.
hal::Result<std::unique_ptr<hal::Rig>> open_rig(const DaemonConfig& config);

}  // namespace hapticd::server
