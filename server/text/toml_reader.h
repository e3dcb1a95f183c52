#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"
#include "server/text/range.h"

namespace hapticd::server {

/// A word of a file and its value.
template <class E>
struct Word {
  std::string_view text;
  E value;
};
/// The word for a value; the first one for a value without.
template <class E, std::size_t N>
std::string_view text_of(E value, const Word<E> (&words)[N]) {
  for (const Word<E>& word : words) {
    if (word.value == value) return word.text;
  }
  return words[0].text;
}

/// One table of a TOML document, read strictly: a reader asks for every key it knows, and
/// TomlDocument::error() then says what was wrong or unknown, by name and line. A key that is absent leaves
/// the value as it was, so defaults live where the value is declared and nowhere else.
class TomlTable {
 public:
  static constexpr bool kReads = true;

  /// The table under `key`; an empty one when there is none.
  TomlTable table(std::string_view key);
  /// The tables of an array [[key]], or key = [{…}, {…}], at most `most`; empty when there is none.
  std::vector<TomlTable> tables(std::string_view key, std::size_t most);
  bool has(std::string_view key) const;
  /// All keys of the table, sorted; for tables whose keys are the user's own names. Each still has to be
  /// read.
  std::vector<std::string> keys() const;
  /// True as has(), and the key counts as known even if it is not read.
  bool wants(std::string_view key);
  std::int64_t line_of(std::string_view key) const;
  /// Refuses the value of `key`, if it is there; the place is filled in here.
  void refuse(std::string_view key, hal::Error error);

  void read(std::string_view key, double& value, const Range& range);
  void read(std::string_view key, std::optional<double>& value, const Range& range);
  void read(std::string_view key, int& value, const Range& range);
  void read(std::string_view key, std::uint32_t& value, const Range& range);
  void read(std::string_view key, std::uint64_t& value, const Range& range);
  void read(std::string_view key, bool& value);
  void read(std::string_view key, std::string& value, std::size_t longest = 1024);
  /// Reads an array of three numbers.
  void read(std::string_view key, hal::Vector3& value, const Range& range);
  /// An array of N numbers.
  template <std::size_t N>
  void read(std::string_view key, std::array<double, N>& values, const Range& range) {
    numbers(key, values, range);
  }
  /// Reads at most `most` pairs of numbers, e.g. [[0, 0.2], [5, 0.8]]. Absent: as it was.
  void read(std::string_view key, std::vector<std::array<double, 2>>& pairs,
            const std::array<Range, 2>& ranges, std::size_t most);
  /// Reads at most `most` numbers. Absent: as it was.
  void read(std::string_view key, std::vector<double>& values, const Range& range, std::size_t most);
  /// One of a few words.
  template <class E, std::size_t N>
  void read(std::string_view key, E& value, const Word<E> (&words)[N]) {
    std::vector<std::string> texts;
    for (const Word<E>& word : words) texts.emplace_back(word.text);
    if (const auto index = choice(key, texts)) value = words[*index].value;
  }

  // The functions of TomlWriter too, so that one description of a section reads and writes it.

  /// Reads as read() does.
  void field(std::string_view key, std::string& value, std::size_t longest = 1024) {
    read(key, value, longest);
  }
  template <class Value, class... Limits>
  requires(!std::is_same_v<Value, std::string>) void field(std::string_view key, Value& value,
                                                           const Limits&... limits) {
    read(key, value, limits...);
  }
  /// Reads the key if it is there; leaves `value` as it is otherwise.
  template <class Value>
  void field(std::string_view key, std::optional<Value>& value, const Range& range) {
    if constexpr (std::is_same_v<Value, double>) {
      read(key, value, range);
    } else if (wants(key)) {
      read(key, value.emplace(), range);
    }
  }
  /// Describes the table under `key` if there is one.
  template <class Value, class Describe>
  void table(std::string_view key, std::optional<Value>& value, const Describe& describe) {
    if (!has(key)) return;
    TomlTable inner = table(key);
    describe(inner, value.emplace());
  }
  /// Describes each of the tables under `key` as a further value.
  template <class Value, class Describe>
  void tables(std::string_view key, std::vector<Value>& values, std::size_t most, const Describe& describe) {
    for (TomlTable& inner : tables(key, most)) describe(inner, values.emplace_back());
  }
  template <class Describe>
  void inline_table(std::string_view key, const Describe& describe) {
    TomlTable inner = table(key);
    describe(inner);
  }
  template <class Value, class Describe>
  void inline_table(std::string_view key, std::optional<Value>& value, const Describe& describe) {
    table(key, value, describe);
  }

 private:
  friend class TomlDocument;
  struct State;
  TomlTable(std::shared_ptr<State> state, std::string path)
      : state_(std::move(state)), path_(std::move(path)) {}

  std::optional<std::size_t> choice(std::string_view key, const std::vector<std::string>& words);
  bool numbers(std::string_view key, std::span<double> values, const Range& range);
  bool integer(std::string_view key, std::int64_t& value, const Range& range);

  std::shared_ptr<State> state_;
  std::string path_;  ///< dotted, empty at the root
};

/// A parsed document and the errors found while it was read.
class TomlDocument {
 public:
  /// `source` names the document in errors, e.g. a path or "scene 'tap_1d'".
  static hal::Result<TomlDocument> parse(std::string_view text, std::string source);
  /// Files larger than 1 MiB are refused.
  static hal::Result<TomlDocument> open(const std::string& path);

  TomlTable root() const;
  /// First error by line, unknown keys included. Call it after all known keys were read.
  std::optional<hal::Error> error() const;
  const std::string& source() const;

 private:
  explicit TomlDocument(std::shared_ptr<TomlTable::State> state) : state_(std::move(state)) {}
  std::shared_ptr<TomlTable::State> state_;
};

}  // namespace hapticd::server
