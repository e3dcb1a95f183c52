#include "client/cpp/error.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/empty.pb.h>
#include <google/protobuf/unknown_field_set.h>

#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "proto/text/utf8_text.h"

namespace hapticd::client {
namespace {

constexpr int kCancelled = 1;
constexpr int kDeadlineExceeded = 4;
constexpr int kUnimplemented = 12;
constexpr int kUnavailable = 14;
constexpr int kStatusDetailsField =
    3;  // google.rpc.Status { int32 code = 1; string message = 2; repeated Any details = 3; }

/// google.rpc.Status is not installed with Debian's protobuf, and only one field of it is needed: it is read
/// as a message without known fields.
std::optional<v1::ErrorDetail> find_detail(const std::string& serialized_status) {
  google::protobuf::Empty status;
  if (serialized_status.empty() || !status.ParseFromString(serialized_status)) return std::nullopt;
  const auto& fields = status.GetReflection()->GetUnknownFields(status);
  for (int i = 0; i < fields.field_count(); ++i) {
    const auto& field = fields.field(i);
    if (field.number() != kStatusDetailsField ||
        field.type() != google::protobuf::UnknownField::TYPE_LENGTH_DELIMITED) {
      continue;
    }
    google::protobuf::Any any;
    v1::ErrorDetail detail;
    if (any.ParseFromString(field.length_delimited()) && any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

ErrorKind kind_of(int code, bool daemon_explained) {
  // The daemon may itself answer with these codes; it then says why.
  if (daemon_explained) return ErrorKind::kRefused;
  if (code == kUnavailable) return ErrorKind::kUnreachable;
  if (code == kDeadlineExceeded) return ErrorKind::kTimedOut;
  return ErrorKind::kRefused;
}

}  // namespace

Error::Error(ErrorKind kind, std::string code, v1::ErrorDetail detail)
    : std::runtime_error(text::printable(one_line(detail))),
      kind_(kind),
      code_(std::move(code)),
      detail_(std::move(detail)) {}

Error error_from_status(int code, const std::string& message, const std::string& serialized_details,
                        const std::string& address) {
  const auto explained = find_detail(serialized_details);
  const ErrorKind kind = kind_of(code, explained.has_value());
  v1::ErrorDetail detail = explained.value_or(v1::ErrorDetail{});
  if (!explained && code == kUnimplemented) {
    detail.set_what("the daemon does not know this call");
    detail.set_where(address);
    detail.set_remedy("it is older than this client: update it");
  }
  if (!explained && code == kCancelled) {  // gRPC's own answer to what is under way when a daemon ends
    detail.set_what("the daemon ended the call before its answer");
    detail.set_where(address);
    detail.set_remedy("see whether hapticd still runs there");
  }
  if (detail.what().empty())
    detail.set_what(message.empty() ? "no reason given" : text::repaired_utf8(message));
  if (kind == ErrorKind::kUnreachable) {
    detail.set_what("the connection to the daemon broke: " + detail.what());
    detail.set_where(address);
    detail.set_remedy("see whether hapticd still runs there, and whether the network carries");
  } else if (kind == ErrorKind::kTimedOut) {
    detail.set_what("the daemon did not answer in time");
    detail.set_where(address);
    detail.set_remedy("allow a longer timeout, or look at the daemon's log");
  }
  return {kind, std::string(status_code_name(code)), std::move(detail)};
}

std::string_view status_code_name(int code) noexcept {
  static constexpr std::array<std::string_view, 17> kNames{
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  if (code < 0 || static_cast<std::size_t>(code) >= kNames.size()) return "UNKNOWN";
  return kNames[static_cast<std::size_t>(code)];
}

std::string one_line(const v1::ErrorDetail& detail) {
  std::string line = detail.where().empty() ? detail.what() : detail.where() + ": " + detail.what();
  if (!detail.value().empty()) line += " (got " + detail.value() + ")";
  if (!detail.limit().empty()) line += "; accepted: " + detail.limit();
  if (!detail.remedy().empty()) line += "; " + detail.remedy();
  return line;
}

}  // namespace hapticd::client
