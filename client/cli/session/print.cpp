#include "client/cli/session/print.h"

#include <cerrno>
#include <cstdio>
#include <iostream>

#include "client/cli/terminal/terminal.h"
#include "proto/text/utf8_text.h"

namespace hapticd::cli {

std::string for_terminal(std::string_view text) {
  const std::string clean = printable(text);
  std::string result;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    if (clean[i] != kStyleMark) {
      result += clean[i];
    } else if (++i < clean.size()) {
      result += style_code(clean[i]);
    }
  }
  return result;
}

void print_line(std::string_view line) {
  fmt::print("{}\n", for_terminal(line));
}

void print_error_line(std::string_view line) {
  std::fflush(stdout);
  fmt::print(stderr, "{}\n", for_terminal(line));
}

void print_text(std::string_view text) {
  fmt::print("{}{}", text::printable_lines(text), text.ends_with('\n') ? "" : "\n");
}

void write_frame(std::string_view frame) {
  std::fwrite(frame.data(), 1, frame.size(), stdout);
  std::fflush(stdout);
}

bool all_was_printed() {
  errno = 0;
  std::cout.flush();
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
}

}  // namespace hapticd::cli
