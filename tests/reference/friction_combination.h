#pragma once

#include <vector>

#include "hal/error.h"
#include "rt/model/identified_model.h"

namespace hapticd::identification {

/// One friction model for several objects, as the dissertation averages the ball bearing's (D§4.4.1): each
/// parameter is the mean of the objects', weighted by 1/(se² + τ²) with τ² the spread between objects beyond
/// what their standard errors explain (DerSimonian and Laird 1986). So a parameter that was reported badly on
/// one object counts little, and one object that was measured for long does not outvote the others. The
/// standard error is the mean's; the spread τ between objects, which is what another object has to expect, is
/// listed as
/// "<name>_spread".
///
/// Fails with fewer than two models, with models of other kinds or of different tips, and if a parameter of
/// no object was determined.
hal::Result<rt::IdentifiedModel> combine_friction(const std::vector<rt::IdentifiedModel>& models);

}  // namespace hapticd::identification
