#include "client/cli/view/watch_view.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/support/texts.h"

namespace hapticd::cli {
namespace {

/// Pressed to 8 mm in as many seconds, under a target stiffness that depends on the depth.
WatchView pressed(double (*target_n_per_mm)(double depth_mm)) {
  WatchView view(10.0);
  for (int i = 0; i <= 800; ++i) {
    const double depth = 0.01 * i;
    v1::TelemetrySample sample;
    sample.set_time_ns(10'000'000LL * i);
    sample.mutable_contact()->set_in_contact(true);
    sample.mutable_contact()->set_reaction_force_n(1.4);
    sample.mutable_deformation()->set_displacement_mm(depth);
    sample.mutable_target()->set_target_stiffness_n_per_mm(target_n_per_mm(depth));
    sample.mutable_control()->set_hand_force_n(3.091);
    sample.mutable_truth()->set_displacement_mm(depth);
    sample.mutable_truth()->mutable_hand_force_n()->set_z(-3.1);
    sample.mutable_truth()->set_in_contact(true);
    view.add(sample);
  }
  return view;
}
double constant(double) {
  return 0.5;
}
double profile(double depth_mm) {
  return depth_mm < 4.0 ? 0.3 : 0.3 + 0.1 * (depth_mm - 4.0);
}

TEST(WatchView, EveryNumberIsWholeOnEveryTerminal) {
  const WatchView view = pressed(constant);
  for (const int width : {60, 80, 100, 120, 200}) {
    const Terminal terminal{.live = true, .unicode = true, .width = width, .height = 24};
    const auto lines = view.frame(client::StreamAccount(1), terminal);
    EXPECT_LE(lines.size(), 24U) << width;
    for (const std::string& line : lines) {
      EXPECT_LE(display_width(line), static_cast<std::size_t>(width)) << line;
    }
    const std::string all = test::joined(lines);
    for (const char* value : {"displacement 8.000 mm", "hand 3.091 N", "reaction 1.400 N",
                              "target 0.500 N/mm", "true hand 3.100 N"}) {
      EXPECT_NE(all.find(value), std::string::npos) << value << " at " << width << ":\n" << all;
    }
  }
}

TEST(WatchView, ATargetThatChangesWithTheDepthIsNoStraightLine) {
  const Terminal terminal{.live = true, .unicode = true, .width = 80, .height = 24};
  EXPECT_NE(test::joined(pressed(constant).frame(client::StreamAccount(1), terminal)).find("target 0.5 N/mm"),
            std::string::npos);
  const std::string bent = test::joined(pressed(profile).frame(client::StreamAccount(1), terminal));
  EXPECT_NE(bent.find("target, 0.7 N/mm now"), std::string::npos) << bent;
  EXPECT_EQ(bent.find("target 0.7 N/mm\n"), std::string::npos);
}

/// Number of places of `part`.
int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

/// Legends of force over displacement and of force over time.
TEST(WatchView, TheLegendsNameEveryCurveOnEveryTerminal) {
  for (const auto& [width, height] : {std::pair{80, 24}, {120, 24}, {120, 40}, {200, 50}}) {
    const Terminal terminal{.live = true, .unicode = true, .width = width, .height = height};
    for (const auto target : {constant, profile}) {
      const auto lines = pressed(target).frame(client::StreamAccount(1), terminal);
      EXPECT_LE(lines.size(), static_cast<std::size_t>(height));
      const std::string all = test::joined(lines);
      EXPECT_EQ(count(all, "╍╍ target"), 1) << all;
      EXPECT_EQ(count(all, "━━ reaction"), 2) << all;
      EXPECT_EQ(count(all, "━━ hand, true"), 2) << all;
      EXPECT_EQ(count(all, "━━ hand"), 4) << all;
    }
  }
}

/// The secant of now would be at 2.8 N in 4 mm, where the profile asks for 1.2 N.
TEST(WatchView, ACurvedTargetIsDrawnAlongThePress) {
  const WatchView view = pressed(profile);
  const Terminal terminal{.live = true, .unicode = true, .width = 80, .height = 60};
  const auto lines = view.frame(client::StreamAccount(1), terminal);
  // Rows of the upper plot, from its heading to its axis; column of the middle of 0 … 8 mm.
  std::size_t top = 0;
  while (top < lines.size() && lines[top].find("force / N") == std::string::npos) ++top;
  std::size_t axis = top;
  while (axis < lines.size() && lines[axis].find("└") == std::string::npos) ++axis;
  ASSERT_LT(axis, lines.size());
  const double rows = static_cast<double>(axis - top - 1);
  // Braille characters are three bytes, as are the box lines: find the lowest row with a dot in columns
  // 38 … 42.
  const auto dotted = [](const std::string& line, int from, int to) {
    int column = 0;
    for (std::size_t i = 0; i < line.size(); ++column) {
      const auto lead = static_cast<unsigned char>(line[i]);
      const std::size_t bytes = lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
      if (column >= from && column <= to && line.compare(i, 2, "\xE2\xA0") == 0) return true;
      if (column >= from && column <= to && line.compare(i, 2, "\xE2\xA1") == 0) return true;
      if (column >= from && column <= to && line.compare(i, 2, "\xE2\xA2") == 0) return true;
      if (column >= from && column <= to && line.compare(i, 2, "\xE2\xA3") == 0) return true;
      i += bytes;
    }
    return false;
  };
  std::size_t lowest = top;
  for (std::size_t row = top + 1; row < axis; ++row) {
    if (dotted(lines[row], 38, 42)) lowest = row;
  }
  // 1.2 N of the 6 N of the axis: in the lowest third. What lies above are the straight lines of the forces.
  EXPECT_GT(static_cast<double>(lowest - top), 0.66 * rows) << test::joined(lines);
}

}  // namespace
}  // namespace hapticd::cli
