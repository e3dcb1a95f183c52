#include "client/cli/text/progress_bar.h"

#include <fmt/core.h>

#include <array>
#include <cmath>

namespace hapticd::cli {
namespace {

constexpr int kEighths = 8;
constexpr std::array<const char*, kEighths> kPartial{"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};

double within(double fraction) {
  if (!(fraction > 0.0)) return 0.0;
  return fraction > 1.0 ? 1.0 : fraction;
}

}  // namespace

std::string progress_bar(double fraction, int width, const Terminal& terminal) {
  const int inside = width - 2;
  if (inside < 1) return std::string(static_cast<std::size_t>(width > 0 ? width : 0), ' ');
  const int steps = terminal.unicode ? kEighths : 1;
  // Rounded down: a bar that is full says that it is over.
  const int filled = static_cast<int>(std::floor(within(fraction) * inside * steps));
  const int whole = filled / steps;
  const char* partial = kPartial[static_cast<std::size_t>(filled % steps)];
  std::string bar;
  for (int i = 0; i < whole; ++i) bar += terminal.unicode ? "█" : "#";
  bar += partial;
  const int rest = inside - whole - (*partial != '\0' ? 1 : 0);
  std::string empty;
  for (int i = 0; i < rest; ++i) empty += terminal.unicode ? "·" : ".";
  return "[" + terminal.paint(Color::kGreen, bar) + terminal.paint(Color::kGrey, empty) + "]";
}

std::string percent_done(double fraction) {
  return fmt::format("{:3.0f} %", std::floor(100.0 * within(fraction)));
}

}  // namespace hapticd::cli
