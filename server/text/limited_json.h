#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hapticd::server {

/// Values of a JSON text. The largest model has some 7 000, most of them its parameters', and the largest
/// calibration some 3 000. Each takes up to 200 bytes.
inline constexpr int kMaxJsonValues = 20000;

/// A JSON text holds more values than that.
struct TooManyValues : std::length_error {
  TooManyValues() : std::length_error("more than " + std::to_string(kMaxJsonValues) + " values") {}
};

/// Parses JSON of a limited depth, for what reads it is recursive, and of a limited number of values, for
/// each takes many times the memory of its text. Throws TooManyValues, other exceptions of the standard
/// library if it is nested too deeply or is not JSON.
template <class Json>
Json parse_limited_json(std::string_view text) {
  constexpr int kMaxNesting = 16;
  int values = 0;
  return Json::parse(text, [&values](int depth, typename Json::parse_event_t event, Json&) {
    if (depth > kMaxNesting) throw std::length_error("nested too deeply");
    using Event = typename Json::parse_event_t;
    const bool is_new = event == Event::value || event == Event::array_start || event == Event::object_start;
    if (is_new && ++values > kMaxJsonValues) throw TooManyValues();
    return true;
  });
}

}  // namespace hapticd::server
