#include "client/cli/view/live_screen.h"

#include <algorithm>

#include "client/cli/session/print.h"

namespace hapticd::cli {
namespace {
constexpr std::chrono::milliseconds kFramePeriod{83};
}

LiveScreen::~LiveScreen() {
  keep();
}

bool LiveScreen::due() const {
  return std::chrono::steady_clock::now() - last_frame_ >= kFramePeriod;
}

void LiveScreen::show(const std::vector<std::string>& lines, const Terminal& terminal) {
  last_frame_ = std::chrono::steady_clock::now();
  // Terminals that know mode 2026 show the frame at once; the others ignore it.
  std::string frame = "\x1b[?2026h";
  if (!cursor_hidden_) frame += "\x1b[?25l";
  cursor_hidden_ = true;
  if (drawn_lines_ > 0) frame += "\x1b[" + std::to_string(drawn_lines_) + "A";
  frame += "\r";
  // The line after the last must exist too, or the terminal scrolls with each frame.
  const std::size_t count =
      std::min(lines.size(), static_cast<std::size_t>(std::max(terminal.height - 1, 1)));
  for (std::size_t i = 0; i < count; ++i) {
    const std::string line = printable(lines[i]);
    frame +=
        for_terminal(padded(line, std::min(display_width(line), static_cast<std::size_t>(terminal.width))));
    frame += "\x1b[K\n";
  }
  frame += "\x1b[J\x1b[?2026l";
  drawn_lines_ = count;
  write_frame(frame);
}

void LiveScreen::keep() {
  drawn_lines_ = 0;
  if (!cursor_hidden_) return;
  write_frame("\x1b[?25h");
  cursor_hidden_ = false;
}

}  // namespace hapticd::cli
