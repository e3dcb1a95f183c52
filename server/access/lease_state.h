#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace hapticd::server {

/// What happens when the holder of a lease is not heard of for its time to live.
enum class LeaseExpiry : std::uint8_t {
  kOfConnection,  ///< kKeep for clients of this machine, kRampToZero for others
  kKeep,
  kRampToZero,
  kStop,
};

/// How control came to be as it is.
enum class LeaseChange : std::uint8_t { kNone, kAcquired, kTaken, kReturned, kExpired };

/// What a client asks for.
struct LeaseTerms {
  std::string purpose;
  std::chrono::nanoseconds ttl = std::chrono::seconds(5);
  LeaseExpiry on_expiry = LeaseExpiry::kOfConnection;
};

/// A lease as others may see it.
struct LeaseView {
  std::uint64_t number = 0;
  std::string holder;
  LeaseTerms terms;
  double age_s = 0.0;
  double remaining_s = 0.0;
  bool is_stale = false;
};

/// Lease as its holder gets it.
struct LeaseGranted {
  LeaseView lease;
  std::string token;
  std::uint64_t changed_after_tick = 0;
};

struct LeaseSnapshot {
  std::optional<LeaseView> lease;
  LeaseChange change = LeaseChange::kNone;
  std::string changed_by;
  std::string reason;
  std::string taker;  ///< waits to take it; empty: no client does
  std::string take_reason;
  double taken_in_s = 0.0;
  std::uint64_t number = 0;
  std::uint64_t version = 0;  ///< rises with every change, also of a take that is announced
};

}  // namespace hapticd::server
