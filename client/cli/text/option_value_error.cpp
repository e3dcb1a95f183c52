#include "client/cli/text/option_value_error.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "proto/text/suggestion.h"
#include "proto/text/utf8_text.h"

namespace hapticd::cli {
namespace {

/// The option that the library's error names; null if there is none.
const CLI::Option* option_named(const CLI::App& command, const CLI::ParseError& error) {
  const std::string text = error.what();
  for (const CLI::App* one = &command; one != nullptr; one = one->get_parent()) {
    for (const CLI::Option* option : one->get_options()) {
      const std::string name = option->get_name();
      if (text.starts_with(name + ": ") || text.starts_with("Could not convert: " + name + " = "))
        return option;
    }
  }
  return nullptr;
}

/// Unit of an option's number, as its description says it; empty if it has none.
std::string unit_of(const CLI::Option& option) {
  static const std::regex kNamed(
      "(?:[Ii]n|… [0-9.]+) (N/mm|N/s|mm/s|deg/s²|deg/s|degrees|N|mm|ns|Hz|g)(?=[,;. ]|$)");
  static const std::regex kSeconds("\\b[Ss]econds\\b");
  const std::string description = option.get_description();
  std::smatch found;
  if (std::regex_search(description, found, kNamed)) return found[1];
  return std::regex_search(description, kSeconds) ? "s" : "";
}

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

/// The numbers that an option accepts, as a person would say it: "1 … 60 s", "greater than 0". Empty: all.
std::string range_of(const std::string& type, const std::string& unit) {
  static const std::regex kRange("in \\[(\\S+) - (\\S+)\\]");
  const std::string in_unit = unit.empty() ? "" : " " + unit;
  if (type.find("POSITIVE") != std::string::npos) return "greater than 0" + in_unit;
  if (type.find("NONNEGATIVE") != std::string::npos) return "0" + in_unit + " or more";
  std::smatch found;
  if (!std::regex_search(type, found, kRange)) return {};
  return fmt::format("{} … {}{}", std::strtod(found[1].str().c_str(), nullptr),
                     std::strtod(found[2].str().c_str(), nullptr), in_unit);
}

/// "a number with a point, in N/mm, such as 0.3".
std::string limit_of(const std::string& type, const std::string& unit) {
  const bool is_whole = !type.starts_with("FLOAT");
  const std::string range = range_of(type, "");
  std::string limit = is_whole ? "a whole number" : "a number with a point";
  if (!unit.empty()) limit += ", in " + unit;
  return limit + ", " + (range.empty() ? std::string(is_whole ? "such as 3" : "such as 0.3") : range);
}

/// Suggests the number that was meant, if there is a comma for the point or a unit behind it; else `help`.
std::string remedy_for(const std::string& value, const std::string& unit, const std::string& help) {
  std::string meant = value;
  if (!unit.empty() && meant.ends_with(unit)) meant.resize(meant.size() - unit.size());
  if (const std::size_t comma = meant.find(','); comma != std::string::npos) meant[comma] = '.';
  return meant != value && is_number(meant) ? "did you mean '" + meant + "'?" : help;
}

/// The words that an option accepts, of "TEXT:{rod,ball_bearing}"; none if it accepts any.
std::vector<std::string> words_of(const std::string& type) {
  std::vector<std::string> words;
  const std::size_t begin = type.find(":{");
  if (begin == std::string::npos) return words;
  std::string word;
  for (const char c : type.substr(begin + 2)) {
    if (c == ',' || c == '}') {
      words.push_back(std::exchange(word, {}));
    } else {
      word += c;
    }
  }
  return words;
}

}  // namespace

std::optional<LocalError> option_value_error(const CLI::App& command, const std::string& words,
                                             const CLI::ParseError& error) {
  const bool is_about_value = error.get_name() == "ConversionError" || error.get_name() == "ValidationError";
  const CLI::Option* option = is_about_value ? option_named(command, error) : nullptr;
  if (option == nullptr || option->results().empty()) return std::nullopt;
  const std::string value = CLI::detail::join(option->results(), ",");
  const std::string where = words + " " + option->get_name();
  const std::string help = words + " --help";
  if (!text::is_utf8(value)) {
    return LocalError("this is not UTF-8", where, text::repaired_utf8(value), "text in UTF-8",
                      "type it where the locale is one of UTF-8, e.g. LC_ALL=C.UTF-8",
                      v1::ERROR_REASON_INVALID);
  }
  const std::string type = option->get_type_name();
  if (const auto choice = words_of(type); !choice.empty()) {
    return LocalError("this is not one of the accepted words", where, value, text::comma_separated(choice),
                      text::did_you_mean(value, choice, help), v1::ERROR_REASON_UNKNOWN_WORD);
  }
  if (!type.starts_with("FLOAT") && !type.starts_with("INT") && !type.starts_with("UINT")) {
    return LocalError("this cannot be read", where, value, type, help, v1::ERROR_REASON_INVALID);
  }
  const std::string unit = unit_of(*option);
  if (error.get_name() == "ValidationError" && is_number(value)) {
    return LocalError("this is out of range", where, value, range_of(type, unit), help,
                      v1::ERROR_REASON_OUT_OF_RANGE);
  }
  return LocalError(type.starts_with("FLOAT") ? "this is not a number" : "this is not a whole number", where,
                    value, limit_of(type, unit), remedy_for(value, unit, help), v1::ERROR_REASON_INVALID);
}

}  // namespace hapticd::cli
