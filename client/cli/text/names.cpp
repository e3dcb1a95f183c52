#include "client/cli/text/names.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "client/cli/session/session.h"
#include "hapticd/v1/rig.pb.h"

namespace hapticd::cli {
namespace {

struct BitNames {
  std::string_view field;
  std::array<std::string_view, 11> words;  // from bit 0
};

// As documented at the fields in telemetry.proto.
constexpr std::array<BitNames, 2> kBitNames{{
    {"status_bits",
     {"force_missing", "force_saturated", "sensor_fault", "device_fault", "sensor_lost", "sensor_warning",
      "device_not_ready", "device_warm", "over_force", "over_speed", "command_stale"}},
    {"limited_bits", {"force", "rate", "power", "pose", "free_air"}},
}};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// "ContactReason" → "CONTACT_REASON_": what every value of the enumeration begins with.
std::string value_prefix(const std::string& type_name) {
  std::string prefix;
  for (const char c : type_name) {
    if (std::isupper(static_cast<unsigned char>(c)) != 0 && !prefix.empty()) prefix += '_';
    prefix += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return prefix + "_";
}

}  // namespace

std::string enum_word(const google::protobuf::EnumDescriptor& type, int value) {
  const auto* descriptor = type.FindValueByNumber(value);
  if (descriptor == nullptr) return "unknown_" + std::to_string(value);
  const std::string prefix = value_prefix(type.name());
  const std::string& name = descriptor->name();
  return lower(name.starts_with(prefix) ? name.substr(prefix.size()) : name);
}

std::string spaced(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::vector<std::string> bit_words(std::string_view field, std::uint32_t bits) {
  std::vector<std::string> words;
  const auto names = std::find_if(kBitNames.begin(), kBitNames.end(),
                                  [field](const BitNames& candidate) { return candidate.field == field; });
  for (std::size_t bit = 0; bit < 32; ++bit) {
    if ((bits >> bit & 1U) == 0) continue;
    if (field == "faults_present_bits") {
      words.push_back(enum_word(*v1::GuardFault_descriptor(), static_cast<int>(bit) + 1));
      continue;
    }
    const bool named = names != kBitNames.end() && bit < names->words.size() && !names->words[bit].empty();
    words.push_back(named ? std::string(names->words[bit]) : "unknown_bit_" + std::to_string(bit));
  }
  return words;
}

std::vector<v1::FieldGroup> parse_groups(const std::string& comma_separated) {
  std::vector<v1::FieldGroup> groups;
  std::size_t begin = 0;
  while (begin < comma_separated.size()) {
    const std::size_t end = std::min(comma_separated.find(',', begin), comma_separated.size());
    const std::string name = lower(comma_separated.substr(begin, end - begin));
    begin = end + 1;
    bool known = false;
    for (int number = v1::FieldGroup_MIN + 1; number <= v1::FieldGroup_MAX; ++number) {
      if (!v1::FieldGroup_IsValid(number) || word(static_cast<v1::FieldGroup>(number)) != name) continue;
      known = true;
      if (std::find(groups.begin(), groups.end(), number) == groups.end()) {
        groups.push_back(static_cast<v1::FieldGroup>(number));
      }
    }
    if (!known) throw LocalError("unknown telemetry group", "--groups", "'" + name + "'", group_list());
  }
  return groups;
}

std::string group_list() {
  std::string list;
  for (int number = v1::FieldGroup_MIN + 1; number <= v1::FieldGroup_MAX; ++number) {
    if (!v1::FieldGroup_IsValid(number)) continue;
    list += (list.empty() ? "" : ", ") + word(static_cast<v1::FieldGroup>(number));
  }
  return list;
}

}  // namespace hapticd::cli
