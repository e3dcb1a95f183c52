#include "server/text/toml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "proto/text/toml_library.h"
#include "proto/text/toml_shape.h"
#include "server/text/suggestion.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

std::string dotted(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : path + "." + std::string(key);
}

std::string indexed(const std::string& path, std::size_t i) {
  return fmt::format("{}[{}]", path, i);
}

/// True for an array of exactly `count` numbers.
bool holds_numbers(const toml::array* array, std::size_t count) {
  return array != nullptr && array->size() == count &&
         std::all_of(array->begin(), array->end(), [](const toml::node& node) { return node.is_number(); });
}

double number_at(const toml::array& array, std::size_t i) {
  return array.get(i)->value<double>().value_or(std::numeric_limits<double>::quiet_NaN());
}

/// Remedy for a syntax error at this place; a comma between two digits is meant as a decimal mark.
std::string syntax_remedy(std::string_view text, const toml::source_position& at) {
  for (toml::source_index line = 1; line < at.line; ++line) {
    text.remove_prefix(std::min(text.size(), text.find('\n')));
    text.remove_prefix(std::min<std::size_t>(text.size(), 1));
  }
  text = text.substr(0, text.find('\n'));
  const auto is_digit = [&text](std::size_t i) {
    return i < text.size() && text[i] >= '0' && text[i] <= '9';
  };
  const std::size_t comma = at.column;  // counted from 1
  if (comma >= 2 && comma <= text.size() && text[comma - 1] == ',' && is_digit(comma - 2) && is_digit(comma))
    return "write a decimal point, not a comma";
  return "correct the syntax";
}

}  // namespace

struct TomlTable::State {
  std::string source;
  toml::table root;
  std::map<std::string, std::vector<std::string>> known;  ///< keys that were read, by table
  std::multimap<std::int64_t, hal::Error> errors;         ///< by line

  const toml::table* table(const std::string& path) const {
    return path.empty() ? &root : root.at_path(path).as_table();
  }
  const toml::node* find(const std::string& path, std::string_view key) {
    auto& keys = known[path];
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.emplace_back(key);
    const toml::table* owner = table(path);
    return owner != nullptr ? owner->get(key) : nullptr;
  }
  std::string place(std::int64_t line) const { return fmt::format("{}, line {}", source, line); }
  void fail(const toml::node& node, hal::Error error) {
    const auto line = static_cast<std::int64_t>(node.source().begin.line);
    error.where = place(line);
    errors.emplace(line, std::move(error));
  }
  void wrong_type(const toml::node& node, const std::string& key, std::string accepted) {
    fail(node, hal::Error::of(hal::ErrorCode::kWrongType, fmt::format("'{}' has the wrong type", key), "",
                              type_name(node), std::move(accepted), "correct the value"));
  }
  void find_unknown(const toml::table& node, const std::string& path) {
    const auto& keys = known[path];
    for (auto&& [key, value] : node) {
      const std::string name(key.str());
      if (std::find(keys.begin(), keys.end(), name) == keys.end()) {
        const auto line = static_cast<std::int64_t>(key.source().begin.line);
        hal::Error error;
        error.what = path.empty() ? fmt::format("unknown key '{}'", name)
                                  : fmt::format("unknown key '{}' in [{}]", name, path);
        error.where = place(line);
        error.limit = comma_separated(keys);
        error.remedy = did_you_mean(name, keys, "remove it");
        error.code = hal::ErrorCode::kUnknownKey;
        errors.emplace(line, std::move(error));
      } else if (const toml::table* inner = value.as_table();
                 inner != nullptr && known.contains(dotted(path, name))) {
        find_unknown(*inner, dotted(path, name));
      } else if (const toml::array* array = value.as_array()) {
        for (std::size_t i = 0; i < array->size(); ++i) {
          const std::string element = indexed(dotted(path, name), i);
          const toml::table* one = array->get(i)->as_table();
          if (one != nullptr && known.contains(element)) find_unknown(*one, element);
        }
      }
    }
  }
};

TomlTable TomlTable::table(std::string_view key) {
  const toml::node* node = state_->find(path_, key);
  TomlTable inner(state_, dotted(path_, key));
  state_->known[inner.path_];  // known even if no key of it is ever read
  if (node != nullptr && !node->is_table()) {
    state_->wrong_type(*node, inner.path_, fmt::format("a table [{}]", inner.path_));
  }
  return inner;
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, std::size_t most) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return {};
  const std::string path = dotted(path_, key);
  const toml::array* array = node->as_array();
  const std::string accepted = fmt::format("up to {} tables, [{{…}}, {{…}}]", most);
  if (array == nullptr ||
      !std::all_of(array->begin(), array->end(), [](const toml::node& one) { return one.is_table(); })) {
    state_->wrong_type(*node, path, accepted);
    return {};
  }
  if (array->size() > most) {
    state_->fail(*node, hal::Error::of(hal::ErrorCode::kOutOfRange, fmt::format("too many of '{}'", path), "",
                                       std::to_string(array->size()), accepted, "leave some out"));
    return {};
  }
  std::vector<TomlTable> tables;
  for (std::size_t i = 0; i < array->size(); ++i) {
    tables.push_back(TomlTable(state_, indexed(path, i)));
    state_->known[tables.back().path_];
  }
  return tables;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  const toml::table* owner = state_->table(path_);
  if (owner == nullptr) return names;
  for (auto&& [key, value] : *owner) names.emplace_back(key.str());
  return names;
}

bool TomlTable::has(std::string_view key) const {
  const toml::table* owner = state_->table(path_);
  return owner != nullptr && owner->contains(key);
}

bool TomlTable::wants(std::string_view key) {
  return state_->find(path_, key) != nullptr;
}

std::int64_t TomlTable::line_of(std::string_view key) const {
  const toml::table* owner = state_->table(path_);
  const toml::node* node = owner != nullptr ? owner->get(key) : nullptr;
  return node != nullptr ? static_cast<std::int64_t>(node->source().begin.line) : 0;
}

void TomlTable::refuse(std::string_view key, hal::Error error) {
  const toml::table* owner = state_->table(path_);
  const auto* found = owner != nullptr ? owner->get(key) : nullptr;
  if (found != nullptr) state_->fail(*found, std::move(error));
}

void TomlTable::read(std::string_view key, double& value, const Range& range) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return;
  if (!node->is_number()) {
    state_->wrong_type(*node, dotted(path_, key), "a number, " + to_text(range));
    return;
  }
  const double number = node->value<double>().value_or(std::numeric_limits<double>::quiet_NaN());
  if (auto error = check(number, range, "'" + dotted(path_, key) + "'", "")) {
    state_->fail(*node, std::move(*error));
    return;
  }
  value = number;
}

void TomlTable::read(std::string_view key, std::optional<double>& value, const Range& range) {
  double number = 0.0;
  const std::size_t errors_before = state_->errors.size();
  read(key, number, range);
  if (has(key) && state_->errors.size() == errors_before) value = number;
}

bool TomlTable::integer(std::string_view key, std::int64_t& value, const Range& range) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return false;
  if (!node->is_integer()) {
    state_->wrong_type(*node, dotted(path_, key), "a whole number, " + to_text(range));
    return false;
  }
  const std::int64_t number = node->value<std::int64_t>().value_or(0);
  if (auto error = check(static_cast<double>(number), range, "'" + dotted(path_, key) + "'", "")) {
    error->value = fmt::format("{}", number);
    state_->fail(*node, std::move(*error));
    return false;
  }
  value = number;
  return true;
}

void TomlTable::read(std::string_view key, int& value, const Range& range) {
  std::int64_t number = 0;
  if (integer(key, number, range)) value = static_cast<int>(number);
}

void TomlTable::read(std::string_view key, std::uint32_t& value, const Range& range) {
  std::int64_t number = 0;
  if (integer(key, number, range)) value = static_cast<std::uint32_t>(number);
}

void TomlTable::read(std::string_view key, std::uint64_t& value, const Range& range) {
  std::int64_t number = 0;
  if (integer(key, number, range)) value = static_cast<std::uint64_t>(number);
}

void TomlTable::read(std::string_view key, bool& value) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return;
  if (const auto* flag = node->as_boolean()) {
    value = flag->get();
  } else {
    state_->wrong_type(*node, dotted(path_, key), "true or false");
  }
}

void TomlTable::read(std::string_view key, std::string& value, std::size_t longest) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return;
  const auto* text = node->as_string();
  if (text == nullptr) {
    state_->wrong_type(*node, dotted(path_, key), "a string");
  } else if (text->get().size() > longest) {
    state_->fail(*node,
                 hal::Error::of(hal::ErrorCode::kTooLong, fmt::format("'{}' is too long", dotted(path_, key)),
                                "", fmt::format("{} bytes", text->get().size()),
                                fmt::format("at most {} bytes", longest), "shorten it"));
  } else {
    value = text->get();
  }
}

void TomlTable::read(std::string_view key, hal::Vector3& value, const Range& range) {
  std::array<double, 3> xyz{};
  if (numbers(key, xyz, range)) value = {xyz[0], xyz[1], xyz[2]};
}

bool TomlTable::numbers(std::string_view key, std::span<double> values, const Range& range) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return false;
  const toml::array* array = node->as_array();
  if (!holds_numbers(array, values.size())) {
    state_->wrong_type(
        *node, dotted(path_, key),
        fmt::format("{} numbers, each {}", values.size() == 3 ? "three" : std::to_string(values.size()),
                    to_text(range)));
    return false;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (auto error = check(number_at(*array, i), range, fmt::format("'{}[{}]'", dotted(path_, key), i), "")) {
      state_->fail(*node, std::move(*error));
      return false;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = number_at(*array, i);
  return true;
}

void TomlTable::read(std::string_view key, std::vector<double>& values, const Range& range,
                     std::size_t most) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  if (array == nullptr || array->empty() || array->size() > most || !holds_numbers(array, array->size())) {
    state_->wrong_type(*node, dotted(path_, key), fmt::format("1 … {} numbers {}", most, to_text(range)));
    return;
  }
  std::vector<double> read(array->size());
  if (numbers(key, read, range)) values = std::move(read);
}

void TomlTable::read(std::string_view key, std::vector<std::array<double, 2>>& pairs,
                     const std::array<Range, 2>& ranges, std::size_t most) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  const bool holds_pairs = array != nullptr && !array->empty() && array->size() <= most &&
                           std::all_of(array->begin(), array->end(), [](const toml::node& pair) {
                             return holds_numbers(pair.as_array(), 2);
                           });
  if (!holds_pairs) {
    state_->wrong_type(
        *node, dotted(path_, key),
        fmt::format("1 … {} pairs of numbers [{}, {}]", most, to_text(ranges[0]), to_text(ranges[1])));
    return;
  }
  std::vector<std::array<double, 2>> read;
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::array& pair = *array->get(i)->as_array();
    read.push_back({number_at(pair, 0), number_at(pair, 1)});
    for (std::size_t j = 0; j < 2; ++j) {
      if (auto error =
              check(read[i][j], ranges[j], fmt::format("'{}[{}][{}]'", dotted(path_, key), i, j), "")) {
        state_->fail(*node, std::move(*error));
        return;
      }
    }
  }
  pairs = std::move(read);
}

std::optional<std::size_t> TomlTable::choice(std::string_view key, const std::vector<std::string>& words) {
  const toml::node* node = state_->find(path_, key);
  if (node == nullptr) return std::nullopt;
  const auto* text = node->as_string();
  if (text == nullptr) {
    state_->wrong_type(*node, dotted(path_, key), "one of " + comma_separated(words));
    return std::nullopt;
  }
  const auto found = std::find(words.begin(), words.end(), text->get());
  if (found == words.end()) {
    state_->fail(*node,
                 hal::Error::of(hal::ErrorCode::kUnknownWord,
                                fmt::format("'{}' is not one of the accepted words", dotted(path_, key)), "",
                                text->get(), comma_separated(words),
                                did_you_mean(text->get(), words, "use one of those")));
    return std::nullopt;
  }
  return static_cast<std::size_t>(found - words.begin());
}

hal::Result<TomlDocument> TomlDocument::parse(std::string_view text, std::string source) {
  if (auto problem = text::check_toml_shape(text)) {
    return hal::Error::of(hal::ErrorCode::kTooLong, problem->what,
                          fmt::format("{}, line {}", source, problem->line), std::move(problem->value),
                          std::move(problem->limit), problem->remedy);
  }
  auto state = std::make_shared<TomlTable::State>();
  try {
    state->root = toml::parse(text, std::string_view(source));
  } catch (const toml::parse_error& error) {
    return hal::Error::of(
        hal::ErrorCode::kSyntax, "not valid TOML: " + std::string(error.description()),
        fmt::format("{}, line {}, column {}", source, error.source().begin.line, error.source().begin.column),
        "", "", syntax_remedy(text, error.source().begin));
  }
  state->source = std::move(source);
  return TomlDocument(std::move(state));
}

hal::Result<TomlDocument> TomlDocument::open(const std::string& path) {
  auto text = read_text_file(path);
  if (!text) return text.error();
  return parse(*text, path);
}

TomlTable TomlDocument::root() const {
  return TomlTable(state_, "");
}

std::optional<hal::Error> TomlDocument::error() const {
  TomlTable::State judged = *state_;
  judged.find_unknown(judged.root, "");
  if (judged.errors.empty()) return std::nullopt;
  return judged.errors.begin()->second;
}

const std::string& TomlDocument::source() const {
  return state_->source;
}

}  // namespace hapticd::server
