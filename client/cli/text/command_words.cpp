#include "client/cli/text/command_words.h"

#include <google/protobuf/descriptor.h>

#include <array>
#include <cctype>
#include <cstddef>
#include <regex>
#include <string_view>
#include <utility>

#include "client/cli/text/names.h"
#include "hapticd/v1/rig.pb.h"

namespace hapticd::cli {
namespace {

/// Methods that the texts of the daemon name.
constexpr std::array<std::pair<std::string_view, std::string_view>, 17> kCommands{{
    {"CalibrationService.AdoptCalibration", "hapticctl calibration adopt HASH"},
    {"IdentificationService.StartIdentification", "hapticctl identify"},
    {"LeaseService.AcquireLease", "hapticctl lease hold"},
    {"LeaseService.TakeLease", "hapticctl lease hold --take WHY"},
    {"PoseService.Subscribe", "hapticctl pose watch"},
    {"RecordingService.StartRecording", "hapticctl record start"},
    {"RecordingService.StopRecording", "hapticctl record stop"},
    {"RenderingService.SetTarget", "hapticctl target set"},
    {"RigService.BiasForceSensor", "hapticctl sensor bias"},
    {"RigService.Diagnose", "hapticctl doctor"},
    {"RigService.HomeDevice", "hapticctl device home"},
    {"SafetyService.Clear", "hapticctl clear"},
    {"SafetyService.Stop", "hapticctl stop"},
    {"SceneService.ExplainScene", "hapticctl scene explain NAME"},
    {"SceneService.ListScenes", "hapticctl scene list"},
    {"SceneService.LoadScene", "hapticctl scene load NAME"},
    {"TelemetryService.Subscribe", "hapticctl telemetry watch"},
}};

std::string command_of(const std::string& method) {
  for (const auto& [name, command] : kCommands) {
    if (name == method) return std::string(command);
  }
  return method;
}

/// "PoseFrame" for "POSE_FRAME".
std::string type_name_of(std::string_view prefix) {
  std::string name;
  bool begins = true;
  for (const char c : prefix) {
    if (c != '_') name += begins ? c : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    begins = c == '_';
  }
  return name;
}

/// The word of a value of any enumeration of the contract; empty for other texts. The enumeration is looked
/// for, not its value: the library finds values only of files that were used before.
std::string word_of_value(const std::string& name) {
  const auto* pool = google::protobuf::DescriptorPool::generated_pool();
  for (std::size_t end = name.rfind('_'); end != std::string::npos && end > 0;
       end = name.rfind('_', end - 1)) {
    const auto* type = pool->FindEnumTypeByName("hapticd.v1." + type_name_of(name.substr(0, end)));
    const auto* value = type == nullptr ? nullptr : type->FindValueByName(name);
    if (value != nullptr) return enum_word(*type, value->number());
  }
  return {};
}

template <class Replace>
std::string replaced(const std::string& text, const std::regex& pattern, Replace replace) {
  std::string result;
  auto begin = text.begin();
  for (auto found = std::sregex_iterator(text.begin(), text.end(), pattern); found != std::sregex_iterator();
       ++found) {
    result.append(begin, text.begin() + found->position());
    result += replace(*found);
    begin = text.begin() + found->position() + found->length();
  }
  return result.append(begin, text.end());
}

/// Bytes of a text of which words are looked for: matching takes stack for each, and a daemon's text may be
/// long.
constexpr std::size_t kMaxSearched = 2000;

std::string in_words(const std::string& text) {
  if (text.size() > kMaxSearched) return text;
  static const std::regex method(R"(([A-Z][A-Za-z]+Service)[./]([A-Z][A-Za-z]+))");
  static const std::regex value(R"(\b[A-Z]+(_[A-Z0-9]+)+\b)");
  static const std::regex field(R"(\b[A-Z][A-Za-z]*Request\.(?=[a-z]))");
  std::string said = replaced(
      text, method, [](const std::smatch& found) { return command_of(found.str(1) + "." + found.str(2)); });
  said = replaced(said, value, [](const std::smatch& found) {
    const std::string word = word_of_value(found.str());
    return word.empty() ? found.str() : word;
  });
  return std::regex_replace(said, field, "");
}

}  // namespace

v1::ErrorDetail in_command_words(v1::ErrorDetail detail) {
  detail.set_where(in_words(detail.where()));
  detail.set_limit(in_words(detail.limit()));
  detail.set_remedy(in_words(detail.remedy()));
  detail.set_what(in_words(detail.what()));
  if (const std::string word = word_of_value(detail.value()); !word.empty()) detail.set_value(word);
  return detail;
}

std::vector<std::string> contract_commands() {
  std::vector<std::string> commands;
  for (const auto& [name, command] : kCommands) commands.emplace_back(command);
  return commands;
}

}  // namespace hapticd::cli
