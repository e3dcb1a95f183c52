#include "client/cli/session/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace hapticd::cli {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// An unset locale says nothing about the terminal, and nearly all of them show UTF-8; one that is set
/// is respected.
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

std::string_view color_code(Color color) {
  switch (color) {
    case Color::kDefault:
      return "0";
    case Color::kGrey:
      return "90";
    case Color::kRed:
      return "91";
    case Color::kGreen:
      return "92";
    case Color::kYellow:
      return "93";
    case Color::kBlue:
      return "94";
    case Color::kMagenta:
      return "95";
    case Color::kCyan:
      return "96";
  }
  return "0";
}

/// Length in bytes of the escape sequence at the start of `text`, 0 where there is none.
std::size_t escape_length(std::string_view text) {
  if (text.size() < 2 || text[0] != '\x1b' || text[1] != '[') return 0;
  const auto end = text.find_first_of("mKJHAl", 2);
  return end == std::string_view::npos ? text.size() : end + 1;
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
  return "\x1b[" + std::string(color_code(color_wanted)) + "m" + std::string(text) + "\x1b[0m";
}

std::string Terminal::bold(std::string_view text) const {
  return color ? "\x1b[1m" + std::string(text) + "\x1b[0m" : std::string(text);
}

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    const std::size_t escape = escape_length(text);
    if (escape == 0 && starts_character(text[0])) ++width;
    text.remove_prefix(std::max<std::size_t>(escape, 1));
  }
  return width;
}

std::string padded(std::string_view text, std::size_t width) {
  const std::size_t present = display_width(text);
  if (present <= width) return std::string(text) + std::string(width - present, ' ');
  std::string cut;
  std::size_t taken = 0;
  bool escaped = false;
  while (!text.empty()) {
    const std::size_t escape = escape_length(text);
    if (escape == 0 && starts_character(text[0]) && ++taken > width) break;
    escaped = escaped || escape > 0;
    cut += text.substr(0, std::max<std::size_t>(escape, 1));
    text.remove_prefix(std::max<std::size_t>(escape, 1));
  }
  return escaped ? cut + "\x1b[0m" : cut;
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
