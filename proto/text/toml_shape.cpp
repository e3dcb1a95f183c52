#include "proto/text/toml_shape.h"

namespace hapticd::text {

namespace {

/// Reads a text once and skips strings and comments.
class Walk {
 public:
  explicit Walk(std::string_view text) : text_(text) {}

  bool done() const { return at_ >= text_.size(); }
  char look() const { return text_[at_]; }
  std::size_t line() const { return line_; }
  std::size_t bytes_in_line() const { return at_ - line_start_; }

  void step() {
    if (text_[at_++] != '\n') return;
    ++line_;
    line_start_ = at_;
  }
  void skip_comment() {
    while (!done() && look() != '\n' && bytes_in_line() <= kMaxTomlLine) step();
  }
  /// Skips a string, from its opening quote. A string of one line ends with the line at the latest: errors in
  /// it are left to the parser.
  void skip_string() {
    const char quote = look();
    const bool has_escapes = quote == '"';
    const std::string_view triple = quote == '"' ? "\"\"\"" : "'''";
    const bool many_lines = text_.substr(at_, 3) == triple;
    for (int i = 0; i < (many_lines ? 3 : 1); ++i) step();
    while (!done() && bytes_in_line() <= kMaxTomlLine) {
      if (has_escapes && look() == '\\') {
        step();
        if (!done()) step();
      } else if (many_lines ? text_.substr(at_, 3) == triple : look() == quote) {
        step();
        if (!many_lines) return;
        step();
        step();
        for (int i = 0; i < 2 && !done() && look() == quote; ++i)
          step();  // quotes just before the end belong to it
        return;
      } else if (!many_lines && look() == '\n') {
        return;
      } else {
        step();
      }
    }
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::size_t line_start_ = 0;
};

}  // namespace

std::optional<TomlShapeProblem> check_toml_shape(std::string_view text) {
  Walk walk(text);
  std::size_t parts = 1;
  std::size_t items = 0;
  while (!walk.done()) {
    switch (walk.look()) {
      case '#':
        walk.skip_comment();
        break;
      case '"':
      case '\'':
        walk.skip_string();
        break;
      case '.':
        ++parts;
        walk.step();
        break;
      case '=':  // behind a key
      case ']':  // behind a table's key, or the last value of an array
        items += parts;
        parts = 1;
        walk.step();
        break;
      case ',':
        ++items;
        parts = 1;
        walk.step();
        break;
      case '\n':
      case '[':
      case '{':
      case '}':
        parts = 1;
        walk.step();
        break;
      default:
        walk.step();
    }
    if (parts > kMaxKeyParts) {
      const std::string limit = std::to_string(kMaxKeyParts);
      return TomlShapeProblem{"a key has too many parts", walk.line(), "more than " + limit + " parts",
                              "at most " + limit + " parts joined by dots", "shorten the key"};
    }
    if (items > kMaxTomlItems) {
      const std::string limit = std::to_string(kMaxTomlItems);
      return TomlShapeProblem{"the text holds too many keys and values", walk.line(), "more than " + limit,
                              "at most " + limit, "leave out what is not needed"};
    }
    if (walk.bytes_in_line() > kMaxTomlLine) {
      const std::string limit = std::to_string(kMaxTomlLine) + " bytes";
      return TomlShapeProblem{"a line is too long", walk.line(), "more than " + limit, "at most " + limit,
                              "break the line, or shorten what it holds"};
    }
  }
  return std::nullopt;
}

}  // namespace hapticd::text
