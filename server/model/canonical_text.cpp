#include "server/model/canonical_text.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "server/text/limited_json.h"

namespace hapticd::server {

namespace {

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

hal::Result<Json> parse_json(std::string_view text, const std::string& where) {
  try {
    return parse_limited_json<Json>(text);
  } catch (const TooManyValues& error) {
    return not_a_model(hal::ErrorCode::kTooLong, "the text holds too many values", where, error.what(),
                       "at most " + std::to_string(kMaxJsonValues));
  } catch (const std::exception& error) {
    std::string_view problem = error.what();  // "[json.exception…] parse error at line 1, …"
    if (problem.starts_with('[')) problem.remove_prefix(std::min(problem.size(), problem.find(']') + 2));
    return not_a_model(hal::ErrorCode::kSyntax, "not JSON", where, std::string(problem.substr(0, 200)));
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
