#pragma once

#include <span>

#include "hal/error.h"
#include "server/identification/estimate/contact/contact_estimate.h"

namespace hapticd::study {

/// The batch reference: K, B ≥ 0 and m of (4.22) by nonlinear least squares of the force over all samples in
/// contact (Ceres, Levenberg-Marquardt, one thread), from a secant line as the start. An error if the library
/// was not there at build time, or does not converge.
hal::Result<identification::HuntCrossleyEstimate> fit_with_ceres(
    std::span<const identification::PalpationSample> palpation);

}  // namespace hapticd::study
