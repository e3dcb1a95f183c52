#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/text/toml_reader.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

/// Writes the tables that a TomlTable reads, key by key in the order of the calls. Its functions are those of
/// a TomlTable that are used to describe a section, so that one description, a template on the table, is read
/// and written. Limits are ignored: what was read is within them.
class TomlWriter {
 public:
  static constexpr bool kReads = false;

  /// Appends to `text`. `path` is the dotted name of the table; its header is written by table() only.
  explicit TomlWriter(std::string& text, std::string path = {}) : text_(text), path_(std::move(path)) {}

  template <class Value, class... Limits>
  void field(std::string_view key, const Value& value, const Limits&...) {
    if constexpr (std::is_same_v<Value, std::string>) {
      line(key, toml_quoted(value));
    } else if constexpr (std::is_same_v<Value, hal::Vector3>) {
      line(key, toml_vector(value));
    } else if constexpr (std::is_same_v<Value, double>) {
      line(key, toml_number(value));
    } else {
      line(key, fmt::format("{}", value));
    }
  }
  template <std::size_t N>
  void field(std::string_view key, const std::array<double, N>& values, const Range&) {
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + toml_number(value);
    line(key, "[" + list + "]");
  }
  void field(std::string_view key, const std::vector<std::array<double, 2>>& pairs,
             const std::array<Range, 2>&, std::size_t) {
    std::string list;
    for (const auto& [a, b] : pairs) {
      list += fmt::format("{}[{}, {}]", list.empty() ? "" : ", ", toml_number(a), toml_number(b));
    }
    line(key, "[" + list + "]");
  }
  /// Writes the key if it has a value.
  template <class Value>
  void field(std::string_view key, const std::optional<Value>& value, const Range& range) {
    if (value) field(key, *value, range);
  }
  template <class E, std::size_t N>
  void field(std::string_view key, const E& value, const Word<E> (&words)[N]) {
    line(key, toml_quoted(text_of(value, words)));
  }

  /// Begins the table under `key`.
  TomlWriter table(std::string_view key) { return begin(key, "\n[", "]\n"); }
  /// Begins the table under `key` if there is a value, and describes it.
  template <class Optional, class Describe>
  void table(std::string_view key, Optional& value, const Describe& describe) {
    if (!value) return;
    TomlWriter inner = table(key);
    describe(inner, *value);
  }
  /// Begins and describes a table for each of the values, [[key]].
  template <class Value, class Describe>
  void tables(std::string_view key, const std::vector<Value>& values, std::size_t, const Describe& describe) {
    for (const Value& value : values) {
      TomlWriter inner = begin(key, "\n[[", "]]\n");
      describe(inner, value);
    }
  }
  /// Describes the table under `key` in one line of its owner: key = { … }.
  template <class Describe>
  void inline_table(std::string_view key, const Describe& describe) {
    text_ += fmt::format("{} = {{ ", key);
    TomlWriter inner(text_, path_);
    inner.is_inline_ = true;
    describe(inner);
    text_ += " }\n";
  }
  template <class Optional, class Describe>
  void inline_table(std::string_view key, Optional& value, const Describe& describe) {
    if (value) inline_table(key, [&](TomlWriter& inner) { describe(inner, *value); });
  }
  /// Writes a value that is TOML already.
  void line(std::string_view key, const std::string& value) {
    text_ += is_inline_ ? fmt::format("{}{} = {}", begun_ ? ", " : "", key, value)
                        : fmt::format("{} = {}\n", key, value);
    begun_ = true;
  }

 private:
  TomlWriter begin(std::string_view key, std::string_view open, std::string_view close) {
    TomlWriter inner(text_, path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key));
    text_ += fmt::format("{}{}{}", open, inner.path_, close);
    return inner;
  }

  std::string& text_;
  std::string path_;
  bool is_inline_ = false;
  bool begun_ = false;
};

/// Text of a description, without the header of its table.
template <class Describe>
std::string toml_fields(const Describe& describe) {
  std::string text;
  TomlWriter table(text);
  describe(table);
  return text;
}

}  // namespace hapticd::server
