#include "server/grpc/messages/access_messages.h"

#include <chrono>

#include "server/text/utf8_text.h"

namespace hapticd::server {

// The contract's enums begin with an unspecified 0; then they have the values of the daemon's, plus one.
v1::Role to_proto(Role role) {
  return static_cast<v1::Role>(static_cast<int>(role) + 1);
}
static_assert(static_cast<int>(Role::kNone) + 1 == v1::ROLE_NONE);
static_assert(static_cast<int>(Role::kMaintainer) + 1 == v1::ROLE_MAINTAINER);
static_assert(static_cast<int>(Role::kConsole) + 1 == v1::ROLE_CONSOLE);

v1::LeaseRule to_proto(LeaseRule rule) {
  return static_cast<v1::LeaseRule>(static_cast<int>(rule));
}
static_assert(static_cast<int>(LeaseRule::kWhenTaken) == v1::LEASE_RULE_WHEN_TAKEN);
static_assert(static_cast<int>(LeaseRule::kRequired) == v1::LEASE_RULE_REQUIRED);

v1::LeaseExpiry to_proto(LeaseExpiry expiry) {
  return static_cast<v1::LeaseExpiry>(static_cast<int>(expiry));
}
static_assert(static_cast<int>(LeaseExpiry::kKeep) == v1::LEASE_EXPIRY_KEEP);
static_assert(static_cast<int>(LeaseExpiry::kStop) == v1::LEASE_EXPIRY_STOP);

/// Expiry; a value of a newer contract ends in the safest action.
LeaseExpiry expiry_of(v1::LeaseExpiry expiry) {
  return v1::LeaseExpiry_IsValid(expiry) ? static_cast<LeaseExpiry>(static_cast<int>(expiry))
                                         : LeaseExpiry::kStop;
}

void fill(const LeaseView& lease, v1::Lease& message) {
  message.set_number(lease.number);
  message.set_holder(repaired_utf8(lease.holder));
  message.set_purpose(repaired_utf8(lease.terms.purpose));
  message.set_ttl_s(std::chrono::duration<double>(lease.terms.ttl).count());
  message.set_on_expiry(to_proto(lease.terms.on_expiry));
  message.set_age_s(lease.age_s);
  message.set_remaining_s(lease.remaining_s);
  message.set_is_stale(lease.is_stale);
}

void fill(const LeaseSnapshot& state, v1::LeaseState& message) {
  if (state.lease) fill(*state.lease, *message.mutable_lease());
  message.set_change(static_cast<v1::LeaseChange>(static_cast<int>(state.change) + 1));
  message.set_changed_by(repaired_utf8(state.changed_by));
  message.set_reason(repaired_utf8(state.reason));
  message.set_taker(repaired_utf8(state.taker));
  message.set_take_reason(repaired_utf8(state.take_reason));
  message.set_taken_in_s(state.taken_in_s);
  message.set_number(state.number);
}
static_assert(static_cast<int>(LeaseChange::kNone) + 1 == v1::LEASE_CHANGE_NONE);
static_assert(static_cast<int>(LeaseChange::kExpired) + 1 == v1::LEASE_CHANGE_EXPIRED);

}  // namespace hapticd::server
