#include "client/cli/view/lease_view.h"

#include <fmt/core.h>

namespace hapticd::cli {

std::string lease_words(const v1::LeaseState& state) {
  std::string text;
  if (state.has_lease()) {
    const v1::Lease& lease = state.lease();
    text = fmt::format(
        "{} controls the rig for {:.0f} s{}{}", lease.holder(), lease.age_s(),
        lease.purpose().empty() ? "" : ": " + lease.purpose(),
        lease.is_stale() ? fmt::format(" (not heard of; expires in {:.1f} s)", lease.remaining_s()) : "");
  } else {
    text = "no one holds the lease";
    if (state.change() == v1::LEASE_CHANGE_EXPIRED)
      text += fmt::format("; that of {} expired: {}", state.changed_by(), state.reason());
  }
  if (!state.taker().empty()) {
    text +=
        fmt::format("; {} takes it in {:.1f} s: {}", state.taker(), state.taken_in_s(), state.take_reason());
  }
  return text;
}

}  // namespace hapticd::cli
