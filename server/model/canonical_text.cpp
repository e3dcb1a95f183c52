#include "server/model/canonical_text.h"

#include <openssl/evp.h>

#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

namespace hapticd::server {

namespace {

constexpr int kMaxNesting = 16;
/// The largest model has some 7 000, most of them its parameters'. Each takes up to 200 bytes.
constexpr int kMaxValues = 20000;

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value == 0.0 ? 0.0 : value).ptr;
  return {text.data(), end};
}

/// Writes canonical text. Json::dump() is not used: its numbers depend on its version and are not always the
/// shortest.
void write_canonical(const Json& json, std::string& text) {
  if (json.is_object()) {
    char mark = '{';
    for (const auto& [key, value] : json.items()) {
      text += std::exchange(mark, ',');
      text += Json(key).dump() + ":";
      write_canonical(value, text);
    }
    text += json.empty() ? "{}" : "}";
  } else if (json.is_array()) {
    char mark = '[';
    for (const Json& value : json) {
      text += std::exchange(mark, ',');
      write_canonical(value, text);
    }
    text += json.empty() ? "[]" : "]";
  } else if (json.is_number()) {
    text += number_text(json.get<double>());
  } else {
    text += json.dump();
  }
}

}  // namespace

std::string canonical_text(const Json& json) {
  std::string text;
  write_canonical(json, text);
  return text;
}

hal::Error not_a_model(hal::ErrorCode code, const std::string& what, const std::string& where,
                       const std::string& value, const std::string& limit) {
  return {what, where, value, limit, "export the model again where it came from", code};
}

// Parses JSON of a limited depth, for what reads it is recursive, and of a limited number of values, for each
// takes many times the memory of its text.
hal::Result<Json> parse_json(std::string_view text, const std::string& where) {
  int values = 0;
  try {
    return Json::parse(text, [&values](int depth, Json::parse_event_t event, Json&) {
      if (depth > kMaxNesting) throw std::length_error("nested too deeply");
      using Event = Json::parse_event_t;
      const bool is_new =
          event == Event::value || event == Event::array_start || event == Event::object_start;
      if (is_new && ++values > kMaxValues) throw std::length_error("too many values");
      return true;
    });
  } catch (const std::exception& error) {
    if (values > kMaxValues) {
      return not_a_model(hal::ErrorCode::kTooLong, "the text holds too many values", where,
                         "more than " + std::to_string(kMaxValues), "at most " + std::to_string(kMaxValues));
    }
    return not_a_model(hal::ErrorCode::kSyntax, "not JSON", where, std::string(error.what()).substr(0, 200));
  }
}

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("SHA-256 is not available");
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += kDigits[digest[i] >> 4U];
    text += kDigits[digest[i] & 0xFU];
  }
  return text;
}

}  // namespace hapticd::server
