#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/identification/gate/palpation_sample.h"
#include "server/identification/session/identification.h"

namespace hapticd::identification {

/// Domain of a contact law that a palpation has to visit before the law may be trusted there: bad coverage is
/// the main source of error (D§4.7.3).
struct ContactDomain {
  double displacement_mm = 1.0;     ///< down to here
  double speed_mm_per_s = 10.0;     ///< up to here, going in
  bool speeds_required = true;      ///< false for a recording, which cannot be asked to go faster
  std::size_t enough_samples = 20;  ///< per cell
};

/// Samples per cell of displacement × speed (in: positive), and which cells are required: slowly at all
/// depths beyond the first fifth; inwards at half of the speed and outwards at any speed in the middle
/// depths; inwards at full speed in the first half, where a press is fastest. Without required speeds: all
/// depths beyond the first fifth, at any.
Coverage contact_coverage(std::span<const PalpationSample> palpation, std::size_t stride,
                          const ContactDomain& domain);

/// Speed that the required cells without enough samples need of the hand.
enum class CoverageNeed : unsigned char { kSlow, kModerate, kFast };
struct MissingCoverage {
  CoverageNeed need;
  std::string words;  ///< "press faster: 60 mm/s and more between 2 and 6 mm"
};
std::vector<MissingCoverage> missing_coverage(const Coverage& coverage, const ContactDomain& domain);

}  // namespace hapticd::identification
