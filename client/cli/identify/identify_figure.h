#pragma once

#include "client/cli/figure/figure.h"
#include "hapticd/v1/identification.pb.h"

namespace hapticd::cli {

/// Figure of the fit (measured points and model) and the coverage of an identification, for a report. Without
/// panels if there is neither.
Figure identify_figure(const v1::IdentificationProgress& progress);

}  // namespace hapticd::cli
