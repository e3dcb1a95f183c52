#include "server/identification/estimate/inclusion/inclusion_press.h"

#include "rt/signal/vector.h"

namespace hapticd::identification {

hal::Vector3 surface_before(const std::optional<hal::Vector3>& quiet_mm, const hal::Vector3& tip_mm) {
  return quiet_mm && rt::norm(*quiet_mm - tip_mm) < Press::kMaxLateMm ? *quiet_mm : tip_mm;
}

}  // namespace hapticd::identification
