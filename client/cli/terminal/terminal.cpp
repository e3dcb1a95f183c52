#include "client/cli/terminal/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>

#include "proto/text/utf8_text.h"

namespace hapticd::cli {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// True if the locale shows UTF-8. An unset one says nothing about the terminal, and nearly all of them show
/// UTF-8; one that is set is respected.
bool locale_shows_unicode() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string value = environment(name);
    if (value.empty()) continue;
    std::transform(value.begin(), value.end(), value.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return value.find("utf-8") != std::string::npos || value.find("utf8") != std::string::npos;
  }
  return true;
}

constexpr char kPlain = '0';
constexpr char kBold = '1';
constexpr char kFirstColor = 'a';

std::string marked(char style) {
  return {kStyleMark, style};
}

/// Length in bytes of the style mark at the start of `text`, 0 if there is none.
std::size_t mark_length(std::string_view text) {
  return text[0] == kStyleMark ? std::min<std::size_t>(text.size(), 2) : 0;
}

bool starts_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
}

}  // namespace

Terminal Terminal::detect() {
  Terminal terminal;
  const std::string term = environment("TERM");
  const bool is_terminal = isatty(STDOUT_FILENO) == 1;
  terminal.live = is_terminal && !term.empty() && term != "dumb";
  terminal.color = terminal.live && environment("NO_COLOR").empty();
  terminal.unicode = locale_shows_unicode();
  winsize size{};
  if (is_terminal && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0) {
    terminal.width = size.ws_col;
    terminal.height = size.ws_row;
  }
  return terminal;
}

std::string Terminal::paint(Color color_wanted, std::string_view text) const {
  if (!color || color_wanted == Color::kDefault) return std::string(text);
  return marked(static_cast<char>(kFirstColor + static_cast<int>(color_wanted))) + std::string(text) +
         marked(kPlain);
}

std::string Terminal::bold(std::string_view text) const {
  return color ? marked(kBold) + std::string(text) + marked(kPlain) : std::string(text);
}

std::string style_code(char style) {
  if (style == kPlain || style == kBold) return std::string("\x1b[") + style + "m";
  // In the order of Color, without its default.
  constexpr std::array<std::string_view, 7> kCodes{"90", "91", "92", "93", "94", "95", "96"};
  const int index = style - kFirstColor - 1;
  if (index < 0 || index >= static_cast<int>(kCodes.size())) return {};
  return "\x1b[" + std::string(kCodes[static_cast<std::size_t>(index)]) + "m";
}

std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t mark = mark_length(text);
    const std::string_view part = mark > 0 ? text.substr(0, mark) : text.substr(0, text.find(kStyleMark));
    result += mark > 0 ? std::string(part) : text::printable(part);
    text.remove_prefix(part.size());
  }
  return result;
}

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    const std::size_t mark = mark_length(text);
    if (mark == 0 && starts_character(text[0])) ++width;
    text.remove_prefix(std::max<std::size_t>(mark, 1));
  }
  return width;
}

std::string padded(std::string_view text, std::size_t width) {
  const std::size_t present = display_width(text);
  if (present <= width) return std::string(text) + std::string(width - present, ' ');
  std::string cut;
  std::size_t taken = 0;
  bool styled = false;
  while (!text.empty()) {
    const std::size_t mark = mark_length(text);
    if (mark == 0 && starts_character(text[0]) && ++taken > width) break;
    styled = styled || mark > 0;
    cut += text.substr(0, std::max<std::size_t>(mark, 1));
    text.remove_prefix(std::max<std::size_t>(mark, 1));
  }
  return styled ? cut + marked(kPlain) : cut;
}

std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  while (!text.empty()) {
    const std::size_t end = text.find(' ');
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    std::string& line = lines.back();
    if (line.empty()) {
      line = word;
    } else if (display_width(line) + 1 + display_width(word) <= width) {
      line += ' ';
      line += word;
    } else {
      lines.emplace_back(word);
    }
  }
  return lines;
}

std::string padded_left(std::string_view text, std::size_t width) {
  const std::size_t present = display_width(text);
  return present >= width ? std::string(text) : std::string(width - present, ' ') + std::string(text);
}

}  // namespace hapticd::cli
