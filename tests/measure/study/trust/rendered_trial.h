#pragma once

#include <vector>

#include "tests/measure/study/trust/trust_trial.h"

namespace hapticd::study {

/// Zeros of the sensor that are off, drift, or do what those of a lab do.
const std::vector<TrustCause>& rendered_causes();

struct RenderedShare {
  double pressed_s = 0.0;   ///< the object pushes with more than 0.3 N
  double rendered_s = 0.0;  ///< of that, the device gives more than 0.02 N
};
/// The tool is waved, and then presses an object eight times.
RenderedShare rendered_share(const TrustCase& trial, const TrustModels& models);

}  // namespace hapticd::study
