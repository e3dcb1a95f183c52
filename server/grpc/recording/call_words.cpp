#include "server/grpc/recording/call_words.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cctype>

namespace hapticd::server {

namespace {

bool is_upper(char c) {
  return std::isupper(static_cast<unsigned char>(c)) != 0;
}
char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

/// "set hand program" for "SimulationService/SetHandProgram".
std::string words_of_method(std::string_view method) {
  std::string words;
  for (const char c : method.substr(method.find('/') + 1)) {
    if (is_upper(c) && !words.empty()) words += ' ';
    words += lower(c);
  }
  return words;
}

/// "rest" for "HAND_PROGRAM_KIND_REST"; other words stay.
std::string word_of(const std::string& name) {
  constexpr std::string_view kZero = "UNSPECIFIED";
  const auto* value =
      google::protobuf::DescriptorPool::generated_pool()->FindEnumValueByName("hapticd.v1." + name);
  if (value == nullptr) return name;
  const auto* zero = value->type()->FindValueByNumber(0);
  std::string word = name;
  if (zero != nullptr && zero->name().ends_with(kZero) && zero->name().size() - kZero.size() < word.size())
    word.erase(0, zero->name().size() - kZero.size());
  std::transform(word.begin(), word.end(), word.begin(), lower);
  return word;
}

/// Takes the next word, or a text in quotes as a whole; both without what is around them.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  std::size_t size = text.find(' ');
  if (text.starts_with('"')) {
    size = 1;
    while (size < text.size() && text[size] != '"') size += text[size] == '\\' ? 2 : 1;
    ++size;
  }
  const std::string_view word = text.substr(0, size);
  text.remove_prefix(word.size());
  return word;
}

/// Whether the arguments are a printed message, and not words: it begins with a field.
bool is_message(std::string_view arguments) {
  const std::string_view first = take_word(arguments);
  return first.ends_with(':') || take_word(arguments) == "{";
}

}  // namespace

std::string words_of_call(std::string_view method, std::string_view arguments) {
  std::string words = words_of_method(method);
  if (!arguments.empty() && !is_message(arguments)) return words + ' ' + std::string(arguments);
  std::string_view separator = ": ";
  for (std::string_view word = take_word(arguments); !word.empty(); word = take_word(arguments)) {
    if (word == "{") {
      words += " (";
      separator = "";
    } else if (word == "}") {
      words += ')';
      separator = ", ";
    } else if (word.ends_with(':') && !word.starts_with('"')) {
      words += separator;
      words += word.substr(0, word.size() - 1);
      separator = " ";
    } else if (separator == " ") {  // the value of a field
      words += ' ' + word_of(std::string(word));
      separator = ", ";
    } else {  // a separate message
      words += separator;
      words += word;
    }
  }
  return words;
}

}  // namespace hapticd::server
