#include "server/grpc/messages/status.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <string>

#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

grpc::StatusCode code_of(RefusalKind kind) {
  switch (kind) {
    case RefusalKind::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case RefusalKind::kOutOfRange:
      return grpc::StatusCode::OUT_OF_RANGE;
    case RefusalKind::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case RefusalKind::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case RefusalKind::kAborted:
      return grpc::StatusCode::ABORTED;
    case RefusalKind::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case RefusalKind::kDeadlineExceeded:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case RefusalKind::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case RefusalKind::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case RefusalKind::kUnauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case RefusalKind::kPermissionDenied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case RefusalKind::kInternal:
      break;
  }
  return grpc::StatusCode::INTERNAL;
}

v1::ErrorReason reason_of(RefusalKind kind) {
  switch (kind) {
    case RefusalKind::kInvalidArgument:
      return v1::ERROR_REASON_INVALID;
    case RefusalKind::kOutOfRange:
      return v1::ERROR_REASON_OUT_OF_RANGE;
    case RefusalKind::kNotFound:
      return v1::ERROR_REASON_NOT_FOUND;
    case RefusalKind::kFailedPrecondition:
      return v1::ERROR_REASON_WRONG_STATE;
    case RefusalKind::kAborted:
      return v1::ERROR_REASON_STATE_CHANGED;
    case RefusalKind::kResourceExhausted:
      return v1::ERROR_REASON_TOO_MANY;
    case RefusalKind::kDeadlineExceeded:
      return v1::ERROR_REASON_TIMED_OUT;
    case RefusalKind::kCancelled:
      return v1::ERROR_REASON_CANCELLED;
    case RefusalKind::kUnavailable:
      return v1::ERROR_REASON_UNAVAILABLE;
    case RefusalKind::kUnauthenticated:
      return v1::ERROR_REASON_NOT_IDENTIFIED;
    case RefusalKind::kPermissionDenied:
      return v1::ERROR_REASON_NOT_PERMITTED;
    case RefusalKind::kInternal:
      break;
  }
  return v1::ERROR_REASON_INTERNAL;
}

/// Unspecified for a code of which clients get the reason of the refusal.
v1::ErrorReason reason_of(hal::ErrorCode code) {
  switch (code) {
    case hal::ErrorCode::kSyntax:
      return v1::ERROR_REASON_SYNTAX;
    case hal::ErrorCode::kUnknownKey:
      return v1::ERROR_REASON_UNKNOWN_KEY;
    case hal::ErrorCode::kMissingKey:
      return v1::ERROR_REASON_MISSING_KEY;
    case hal::ErrorCode::kWrongType:
      return v1::ERROR_REASON_WRONG_TYPE;
    case hal::ErrorCode::kUnknownWord:
      return v1::ERROR_REASON_UNKNOWN_WORD;
    case hal::ErrorCode::kMisplacedKey:
      return v1::ERROR_REASON_MISPLACED_KEY;
    case hal::ErrorCode::kTooLong:
      return v1::ERROR_REASON_TOO_LONG;
    case hal::ErrorCode::kOutOfRange:
      return v1::ERROR_REASON_OUT_OF_RANGE;
    default:
      return v1::ERROR_REASON_UNSPECIFIED;
  }
}

v1::ErrorReason reason_of(const Refusal& refusal) {
  switch (refusal.reason) {
    case Reason::kOfKind: {
      const v1::ErrorReason of_text = reason_of(refusal.error.code);
      return of_text == v1::ERROR_REASON_UNSPECIFIED ? reason_of(refusal.kind) : of_text;
    }
    case Reason::kNoScene:
      return v1::ERROR_REASON_NO_SCENE;
    case Reason::kNotInThisScene:
      return v1::ERROR_REASON_NOT_IN_THIS_SCENE;
    case Reason::kInContact:
      return v1::ERROR_REASON_IN_CONTACT;
    case Reason::kNotInContact:
      return v1::ERROR_REASON_NOT_IN_CONTACT;
    case Reason::kGuardLatched:
      return v1::ERROR_REASON_GUARD_LATCHED;
    case Reason::kFaultPersists:
      return v1::ERROR_REASON_FAULT_PERSISTS;
    case Reason::kNoHardware:
      return v1::ERROR_REASON_NO_HARDWARE;
    case Reason::kNotSimulated:
      return v1::ERROR_REASON_NOT_SIMULATED;
    case Reason::kRecordingEnded:
      return v1::ERROR_REASON_RECORDING_ENDED;
    case Reason::kBusy:
      return v1::ERROR_REASON_BUSY;
    case Reason::kInUse:
      return v1::ERROR_REASON_IN_USE;
    case Reason::kDiskFull:
      return v1::ERROR_REASON_DISK_FULL;
    case Reason::kStoreLost:
      return v1::ERROR_REASON_STORE_LOST;
    case Reason::kLeaseHeld:
      return v1::ERROR_REASON_LEASE_HELD;
    case Reason::kLeaseRequired:
      return v1::ERROR_REASON_LEASE_REQUIRED;
    case Reason::kLeaseLost:
      return v1::ERROR_REASON_LEASE_LOST;
  }
  return reason_of(refusal.kind);
}

/// google.rpc.Status {1: code, 2: message, 3: details} in its wire format. The distribution ships no header
/// of that message, and a second definition of it would clash with the one inside gRPC's own libraries.
std::string serialise_rpc_status(grpc::StatusCode code, const std::string& message,
                                 const google::protobuf::Any& detail) {
  using google::protobuf::internal::WireFormatLite;
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    WireFormatLite::WriteInt32(1, static_cast<int>(code), &coded);
    WireFormatLite::WriteString(2, message, &coded);
    WireFormatLite::WriteBytes(3, detail.SerializeAsString(), &coded);
  }
  return bytes;
}

}  // namespace

namespace {

// The parts that may contain text of the client are kept short: a status is three times in the trailers of a
// call (as its message, in the google.rpc.Status and in its detail), and trailers larger than 8 KiB do not
// arrive.
constexpr std::size_t kMaxPart = 200;
constexpr std::size_t kMaxLimit = 600;  // lists of accepted words
constexpr std::size_t kMaxRemedy = 300;

/// Error as it can be sent: UTF-8, and of bounded length.
hal::Error sendable(const hal::Error& error) {
  return {
      shortened(repaired_utf8(error.what), kMaxPart),     shortened(repaired_utf8(error.where), kMaxPart),
      shortened(repaired_utf8(error.value), kMaxPart),    shortened(repaired_utf8(error.limit), kMaxLimit),
      shortened(repaired_utf8(error.remedy), kMaxRemedy), error.code};
}

v1::ErrorDetail detail_of(const hal::Error& sendable_error) {
  v1::ErrorDetail detail;
  detail.set_what(sendable_error.what);
  detail.set_where(sendable_error.where);
  detail.set_value(sendable_error.value);
  detail.set_limit(sendable_error.limit);
  detail.set_remedy(sendable_error.remedy);
  detail.set_reason(reason_of(sendable_error.code));
  return detail;
}

}  // namespace

v1::ErrorDetail to_detail(const hal::Error& error) {
  return detail_of(sendable(error));
}

grpc::Status to_status(const Refusal& refusal) {
  const hal::Error error = sendable(refusal.error);
  google::protobuf::Any any;
  v1::ErrorDetail detail = detail_of(error);
  detail.set_reason(reason_of(refusal));
  any.PackFrom(detail);
  const grpc::StatusCode code = code_of(refusal.kind);
  const std::string text = error.text();
  return {code, text, serialise_rpc_status(code, text, any)};
}

}  // namespace hapticd::server
