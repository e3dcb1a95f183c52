#pragma once

#include <utility>

#include "rt/contribution/contribution.h"
#include "rt/modulation/contact_transient.h"

namespace hapticd::rt {

/// Force of the first moments of a contact, as another material would have them.
class TransientForce final : public Contribution {
 public:
  explicit TransientForce(ContactTransient transient) noexcept : transient_(std::move(transient)) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    return transient_.update({now.in_contact, now.in_contact && now.began, now.earned_authority,
                              now.rate_mm_per_s, now.normal, now.tool.interval});
  }
  void fill_record(const ContactState& /*now*/, TickRecord& record) const noexcept override {
    record.transient_force_n = transient_.force_n();
    record.transient_impact_mm_per_s = transient_.impact_mm_per_s();
    record.transient_share = transient_.amplitude_share();
    record.transient_count = transient_.count();
  }
  void reset() noexcept override { transient_.reset(); }

 private:
  ContactTransient transient_;
};

}  // namespace hapticd::rt
