#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "hapticd/v1/common.pb.h"

namespace hapticd::client {

/// Why a call did not succeed.
enum class ErrorKind {
  kBadAddress,   ///< the address given cannot be one
  kUnreachable,  ///< no daemon answers there, or the connection broke
  kTimedOut,     ///< it is there, but did not answer within the timeout
  kRefused,      ///< it answered with a refusal; the detail says what, where, the limit and the remedy
  kUnreadable,   ///< what it sent is not what the contract says
  kBadClock,     ///< a clock ran backwards, or runs away faster than was stated
};

/// Thrown by every call of the library that does not succeed. what() is one line with all that is known:
/// place, complaint, value, what is accepted, remedy; it is safe for a terminal and for a log. detail() has
/// the texts as the daemon sent them. A program branches on kind() and detail().reason().
class Error : public std::runtime_error {
 public:
  /// `code`: name of the gRPC status, e.g. "INVALID_ARGUMENT"; empty if no call was made.
  Error(ErrorKind kind, std::string code, v1::ErrorDetail detail);

  ErrorKind kind() const noexcept { return kind_; }
  /// Name of the gRPC status, e.g. "INVALID_ARGUMENT"; empty if no call was made.
  const std::string& code() const noexcept { return code_; }
  /// `what` is always filled, the rest if the daemon gave it; `reason` only if the daemon refused.
  const v1::ErrorDetail& detail() const noexcept { return detail_; }

 private:
  ErrorKind kind_;
  std::string code_;
  v1::ErrorDetail detail_;
};

/// What went wrong in one call, from the parts a gRPC status carries. `code` is the number of the status,
/// `serialized_details` its binary google.rpc.Status (may be empty), `address` where the daemon was looked
/// for.
Error error_from_status(int code, const std::string& message, const std::string& serialized_details,
                        const std::string& address);

/// "INVALID_ARGUMENT" for 3; "UNKNOWN" for a number that is not a gRPC status.
std::string_view status_code_name(int code) noexcept;

/// One line: place, complaint, value, what is accepted, remedy.
std::string one_line(const v1::ErrorDetail& detail);

}  // namespace hapticd::client
