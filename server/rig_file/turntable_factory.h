#pragma once

#include <memory>

#include "hal/error.h"
#include "hal/turntable.h"
#include "server/rig_file/turntable_config.h"

namespace hapticd::server {

/// Makes the turntable that the configuration names, not engaged; null for none.
hal::Result<std::unique_ptr<hal::Turntable>> make_turntable(const TurntableConfig& config);

}  // namespace hapticd::server
