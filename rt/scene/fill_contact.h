#pragma once

#include "rt/contact/contact_stage.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// The contact group of a record, but for the reaction force.
template <class Value>
void fill_contact(const BasicContactStage<Value>& contact, TickRecord& record) noexcept {
  record.in_contact = contact.in_contact();
  record.contact_reason = contact.detector().reason();
  record.contact_count = contact.detector().count();
  record.withdrawn_count = contact.detector().withdrawn_count();
  record.contact_authority = contact.authority();
  record.contact_force_n = contact.force_n();
  record.contact_onset = contact.onset();
}

/// Gives guide, fixture and watch what they need of the contact.
template <class Value>
Touch touch_of(const BasicContactStage<Value>& contact, double reaction_n, double displacement_mm) noexcept {
  return {contact.in_contact(), contact.in_contact() && contact.authority() >= kEvidentAuthority,
          contact.detector().reason() == ContactReason::kWithdrawn, reaction_n, displacement_mm};
}

}  // namespace hapticd::rt
