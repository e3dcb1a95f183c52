#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/netft/netft_config.h"
#include "hal/netft/netft_configuration.h"

namespace hapticd::netft {

/// What makes a box unfit for this configuration: another calibration than the expected, its stream switched
/// off or too slow. Nothing when it will do.
std::optional<hal::Error> refuse_box(const BoxConfiguration& box, const NetFtConfig& config);

/// What could be better, each with its remedy: a rate below the one wanted, another filter than expected or
/// one that delays, a transformation of its own.
std::vector<std::string> findings_of(const BoxConfiguration& box, const NetFtConfig& config);

}  // namespace hapticd::netft
