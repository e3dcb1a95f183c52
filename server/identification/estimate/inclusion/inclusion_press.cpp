#include "server/identification/estimate/inclusion/inclusion_press.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::identification {

hal::Vector3 surface_before(const std::optional<hal::Vector3>& quiet_mm, const hal::Vector3& tip_mm) {
  return quiet_mm && rt::norm(*quiet_mm - tip_mm) < Press::kMaxLateMm ? *quiet_mm : tip_mm;
}

std::vector<Press> cut_into_presses(const std::vector<PressSample>& recording, double rate_hz,
                                    double threshold_n, double kept_hz) {
  std::vector<Press> presses;
  const auto every = static_cast<std::size_t>(std::max(1.0, std::round(rate_hz / kept_hz)));
  bool touching = false;
  std::size_t since = 0;
  std::optional<hal::Vector3> quiet_mm;
  for (const PressSample& s : recording) {
    const double force_n = rt::norm(s.force_n);
    if (force_n < Press::kQuietShare * threshold_n) quiet_mm = s.tip_mm;
    if (!touching && force_n > threshold_n) {
      touching = true;
      since = 0;
      presses.push_back({surface_before(quiet_mm, s.tip_mm), {}});
    } else if (touching && force_n < 0.5 * threshold_n) {
      touching = false;
    }
    if (touching && since++ % every == 0) presses.back().samples.push_back(s);
  }
  std::erase_if(presses, [](const Press& p) { return p.samples.size() < 3; });
  return presses;
}

}  // namespace hapticd::identification
