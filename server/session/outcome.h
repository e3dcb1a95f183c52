#pragma once

#include <cstdint>
#include <utility>
#include <variant>

#include "hal/error.h"

namespace hapticd::server {

/// Kind of a refusal, one for each status code. It is chosen where the cause is known, not derived at the
/// network.
enum class RefusalKind : std::uint8_t {
  kInvalidArgument,     ///< wrong whatever the state of the service
  kOutOfRange,          ///< a number outside its range
  kNotFound,            ///< no such name
  kFailedPrecondition,  ///< right in another state, e.g. with a scene loaded
  kAborted,             ///< the state changed while the call waited
  kResourceExhausted,   ///< too many at once
  kDeadlineExceeded,    ///< withdrawn: it will not take effect later
  kCancelled,           ///< the caller left
  kUnavailable,         ///< starting or shutting down
  kUnauthenticated,     ///< the caller has no identity
  kPermissionDenied,    ///< the caller has not the role
  kInternal,
};

/// What a program can branch on, finer than the kind: v1.ErrorReason in the contract.
enum class Reason : std::uint8_t {
  kOfKind,  ///< nothing beyond the kind
  kNoScene,
  kNotInThisScene,
  kInContact,
  kNotInContact,
  kGuardLatched,
  kFaultPersists,
  kNoHardware,
  kNotSimulated,
  kRecordingEnded,
  kBusy,
  kInUse,
  kDiskFull,
  kStoreLost,
  kLeaseHeld,
  kLeaseRequired,
  kLeaseLost,
};

/// Why a call was not served.
struct Refusal {
  RefusalKind kind = RefusalKind::kInternal;
  hal::Error error;
  Reason reason = Reason::kOfKind;
};

/// Result of a call: a value, or the reason why there is none.
template <class T>
class [[nodiscard]] Outcome {
 public:
  Outcome(T value) : content_(std::move(value)) {}            // NOLINT(google-explicit-constructor)
  Outcome(Refusal refusal) : content_(std::move(refusal)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const noexcept { return content_.index() == 0; }
  T& operator*() { return std::get<0>(content_); }
  const T& operator*() const { return std::get<0>(content_); }
  T* operator->() { return &std::get<0>(content_); }
  const T* operator->() const { return &std::get<0>(content_); }
  const Refusal& refusal() const { return std::get<1>(content_); }

 private:
  std::variant<T, Refusal> content_;
};

}  // namespace hapticd::server
