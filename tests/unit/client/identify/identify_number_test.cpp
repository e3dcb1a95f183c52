#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "client/cli/text/progress_bar.h"
#include "client/cli/text/uncertain_number.h"

namespace hapticd::cli {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
const Terminal kUnicodeTerminal{.unicode = true};
const Terminal kAsciiTerminal{};

std::string text(double value, double error) {
  return parameter_text("mass_g", value, error, true);
}

TEST(UncertainNumber, TheErrorHasTwoSignificantDigitsAndTheNumberAsManyDecimals) {
  EXPECT_EQ(text(0.07912, 0.00118), "0.0791 ± 0.0012");
  EXPECT_EQ(text(1.634, 0.021), "1.634 ± 0.021");
  EXPECT_EQ(text(12.3456, 1.0), "12.3 ± 1.0");
  EXPECT_EQ(text(-5.0, 0.25), "-5.00 ± 0.25");
  EXPECT_EQ(text(3.2, 45.6), "3 ± 46");
  EXPECT_EQ(text(12345.0, 120.0), "12350 ± 120");
  EXPECT_EQ(text(12345.0, 4567.0), "12300 ± 4600");
  EXPECT_EQ(parameter_text("mass_g", 1.634, 0.021, false), "1.634 +- 0.021");
}

TEST(UncertainNumber, RoundingUpToTheNextPowerKeepsTwoDigits) {
  EXPECT_EQ(text(1.0, 0.0996), "1.00 ± 0.10");
  EXPECT_EQ(text(100.0, 9.96), "100 ± 10");
  EXPECT_EQ(text(0.5, 0.0994), "0.500 ± 0.099");
  EXPECT_EQ(text(-0.0001, 0.12), "0.00 ± 0.12");
}

TEST(UncertainNumber, VeryLargeAndVerySmallOnesShareAPowerOfTen) {
  EXPECT_EQ(text(7.912e-9, 1.18e-10), "7.91e-09 ± 0.12e-09");
  EXPECT_EQ(text(4.0e12, 3.0e10), "4.000e+12 ± 0.030e+12");
  EXPECT_EQ(text(1e-320, 1e-321), "1e-320 ± 1e-321");  // below what is normal, still no division by zero
}

TEST(UncertainNumber, UnknownValuesAreMarked) {
  EXPECT_EQ(text(0.0791, kInfinity), "0.0791 ± ∞");
  EXPECT_EQ(parameter_text("mass_g", 0.0791, kInfinity, false), "0.0791 +- inf");
  EXPECT_EQ(text(0.0791, kNone), "0.0791 ± ?");
  EXPECT_EQ(text(0.0791, -1.0), "0.0791 ± ?");
  EXPECT_EQ(text(kNone, 0.1), "-");
  EXPECT_EQ(text(kInfinity, 0.1), "-");
  EXPECT_EQ(text(0.25, 0.0), "0.25");
  EXPECT_EQ(text(0.0, 0.0), "0");
}

TEST(UncertainNumber, ARoundingErrorDoesNotMakeEndlessDigits) {
  EXPECT_EQ(text(1.0 / 3.0, 1e-14), "0.333333333 ± 1e-14");
}

TEST(ProgressBar, HasItsWidthWhateverTheFraction) {
  for (const Terminal& terminal : {kUnicodeTerminal, kAsciiTerminal}) {
    for (const int width : {3, 10, 41}) {
      for (const double fraction : {-1.0, 0.0, 0.3, 0.999, 1.0, 7.0, kInfinity, kNone}) {
        EXPECT_EQ(display_width(progress_bar(fraction, width, terminal)), static_cast<std::size_t>(width));
      }
    }
  }
  EXPECT_EQ(progress_bar(0.5, 0, kAsciiTerminal), "");
}

TEST(ProgressBar, IsFullOnlyAtTheEnd) {
  EXPECT_EQ(progress_bar(0.5, 12, kAsciiTerminal), "[#####.....]");
  EXPECT_EQ(progress_bar(0.9999, 12, kAsciiTerminal), "[#########.]");
  EXPECT_EQ(progress_bar(1.0, 12, kAsciiTerminal), "[##########]");
  EXPECT_EQ(progress_bar(0.55, 12, kUnicodeTerminal), "[█████▌····]");
  EXPECT_EQ(progress_bar(kNone, 7, kAsciiTerminal), "[.....]");
  EXPECT_EQ(percent_done(0.9999), " 99 %");
  EXPECT_EQ(percent_done(1.0), "100 %");
  EXPECT_EQ(percent_done(kNone), "  0 %");
}

}  // namespace
}  // namespace hapticd::cli
