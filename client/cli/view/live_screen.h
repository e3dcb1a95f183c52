#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// Lines at the bottom of a terminal that are redrawn in place, without flicker and without leaving the
/// scroll-back. The last frame stays when the object goes.
class LiveScreen {
 public:
  LiveScreen() = default;
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// True when the time for another frame has come (12 a second).
  bool due() const;
  /// Shows a frame in the place of the last one; lines are cut to the terminal's width, the frame to its
  /// height.
  void show(const std::vector<std::string>& lines, const Terminal& terminal);
  /// Leaves the last frame where it is; the next one is drawn below it.
  void keep();

 private:
  std::size_t drawn_lines_ = 0;
  bool cursor_hidden_ = false;
  std::chrono::steady_clock::time_point last_frame_{};
};

}  // namespace hapticd::cli
