#include "rt/target/contact_release.h"

#include <algorithm>

#include "rt/target/release_fade.h"

namespace hapticd::rt {

void ContactRelease::update(bool in_contact, double authority, double displacement_mm,
                            const TickInterval& interval) noexcept {
  if (in_contact) {
    share_ = 1.0;
    authority_ = authority;
    displacement_mm_ = std::max(0.0, displacement_mm);
    return;
  }
  displacement_mm_ = std::clamp(displacement_mm, 0.0, displacement_mm_);
  share_ = std::max(0.0, share_ - interval.s / ReleaseFade::kDurationS);
  if (displacement_mm_ == 0.0 || is_cut_) share_ = 0.0;
}

}  // namespace hapticd::rt
