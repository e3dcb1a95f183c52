#pragma once

#include <string>
#include <utility>

#include "hal/error.h"

namespace hapticd::calibration {

/// Refusal of poses that were pushed.
inline hal::Error poses_refusal(std::string what, std::string value, std::string limit, std::string remedy) {
  return {std::move(what), "reference poses", std::move(value), std::move(limit), std::move(remedy)};
}

}  // namespace hapticd::calibration
