#pragma once

#include "rt/modulation/contact_transient.h"
#include "rt/modulation/friction_modulation.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// Fills in what friction modulation and transients report of a tick.
inline void fill_friction(const FrictionModulation& friction, TickRecord& record) noexcept {
  record.friction_scale = friction.scale();
  record.friction_is_bounded = friction.is_bounded();
  record.friction_added_n = friction.force_n();
}
inline void fill_transient(const ContactTransient& transient, TickRecord& record) noexcept {
  record.transient_force_n = transient.force_n();
  record.transient_impact_mm_per_s = transient.impact_mm_per_s();
  record.transient_share = transient.amplitude_share();
  record.transient_count = transient.count();
}

}  // namespace hapticd::rt
