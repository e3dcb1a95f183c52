#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/netft/netft_config.h"
#include "hal/netft/netft_configuration.h"
#include "hal/netft/rdt_stream.h"

namespace hapticd::netft {

/// The reason to refuse this box: an unexpected calibration, its stream switched off or too slow. Nothing
/// if the box is usable.
std::optional<hal::Error> refuse_box(const BoxConfiguration& box, const NetFtConfig& config);

/// Findings about the settings, each with its remedy: a rate below the expected one, an unexpected filter
/// or one that delays, a tool transformation in the box.
std::vector<std::string> findings_of(const BoxConfiguration& box, const NetFtConfig& config);

/// Readings at the end of range of each axis, N and N·mm; zeros for a model that is not known.
SixAxes<double> ranges_of(const std::string& model);

}  // namespace hapticd::netft
