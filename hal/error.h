#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

namespace hapticd::hal {

/// The kind of an error, for code to branch on: the texts of an error are for people and may change.
enum class ErrorCode : std::uint8_t {
  kOther,  ///< no caller branches on it
  // These are sent to clients, as v1.ErrorReason:
  kSyntax,
  kUnknownKey,
  kMissingKey,
  kWrongType,
  kUnknownWord,   ///< none of the words the value may be
  kMisplacedKey,  ///< known, but without meaning next to what else was said
  kTooLong,       ///< text, list, nesting or file
  kOutOfRange,
  // For these, clients get the reason of the refusal:
  kNotFinite,
  kMalformed,      ///< a value without the form it must have, e.g. that of a name or an address
  kContradiction,  ///< values that are allowed alone, but not together
  kNotFound,       ///< no such file, scene, model or map
  kUnreadable,     ///< a file or folder that is there and cannot be read
  kDamaged,        ///< a file whose content is not what it must be
  kInUse,          ///< held by another process
  kFull,           ///< the disk or a quota
  kSwitchedOff,    ///< off because the configuration says so
  kBusy,           ///< a device that answers, but takes the request later
};

/// What went wrong, in the five parts a person needs to fix it. Every refusal of the service, from a
/// scene file to an RPC, is one of these; the network adds only a status code.
struct Error {
  std::string what;    ///< the complaint, e.g. "unknown key 'stifness'"
  std::string where;   ///< the place, e.g. "scene 'tap_1d', line 12" or "SetTargetRequest.stiffness_n_per_mm"
  std::string value;   ///< the offending value as text, empty if there is none
  std::string limit;   ///< what would be accepted, e.g. "0 … 1000 N/mm"
  std::string remedy;  ///< what to do, e.g. "did you mean 'stiffness_n_per_mm'?"
  ErrorCode code = ErrorCode::kOther;

  static Error of(ErrorCode code, std::string what, std::string where, std::string value, std::string limit,
                  std::string remedy) {
    return {std::move(what), std::move(where), std::move(value), std::move(limit), std::move(remedy), code};
  }

  /// One line for logs and terminals.
  std::string text() const {
    std::string line = where.empty() ? what : where + ": " + what;
    if (!value.empty()) line += " (got " + value + ")";
    if (!limit.empty()) line += "; accepted: " + limit;
    if (!remedy.empty()) line += "; " + remedy;
    return line;
  }
};

/// A value, or the reason why there is none. Never used in the tick: errors belong to set-up and to the
/// network.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const noexcept { return content_.index() == 0; }
  T& operator*() { return std::get<0>(content_); }
  const T& operator*() const { return std::get<0>(content_); }
  T* operator->() { return &std::get<0>(content_); }
  const T* operator->() const { return &std::get<0>(content_); }
  const Error& error() const { return std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

}  // namespace hapticd::hal
