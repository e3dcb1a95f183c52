#pragma once

#include <google/protobuf/generated_enum_reflection.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// The word for a value of an enumeration of the contract: "above_threshold" for
/// CONTACT_REASON_ABOVE_THRESHOLD; "unknown_7" for a value this client does not know.
std::string enum_word(const google::protobuf::EnumDescriptor& type, int value);

template <class Enum>
std::string word(Enum value) {
  return enum_word(*google::protobuf::GetEnumDescriptor<Enum>(), static_cast<int>(value));
}

/// "device fault" for "device_fault".
std::string spaced(std::string text);

/// Words for the bits of a field such as "status_bits" or "limited_bits"; empty when no bit is set.
std::vector<std::string> bit_words(std::string_view field, std::uint32_t bits);

/// "contact,truth" → groups, in the order given, each once. Throws LocalError with the word that is not a
/// group.
std::vector<v1::FieldGroup> parse_groups(const std::string& comma_separated);
/// "sample, motion, …": all that there are.
std::string group_list();

}  // namespace hapticd::cli
