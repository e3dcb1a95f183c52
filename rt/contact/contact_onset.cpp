#include "rt/contact/contact_onset.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

void ContactOnset::remember(double depth_mm, double prompt_force_n) noexcept {
  newest_ = (newest_ + 1) % kMemory;
  ring_[newest_] = {depth_mm, prompt_force_n};
  filled_ = std::min(filled_ + 1, kMemory);
}

double ContactOnset::depth_mm(double quiet_n) const noexcept {
  double depth = 0.0;
  for (std::size_t age = 0; age < filled_; ++age) {
    const Moment& moment = ring_[(newest_ + kMemory - age) % kMemory];
    depth = moment.depth_mm;
    if (std::abs(moment.force_n) <= quiet_n) break;
  }
  return depth;
}

}  // namespace hapticd::rt
