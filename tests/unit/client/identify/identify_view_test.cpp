#include "client/cli/identify/identify_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "tests/support/texts.h"
#include "tests/unit/client/identify/identify_fake_service.h"

namespace hapticd::cli {
namespace {

using test::contact_end;
using test::contact_progress;

const Terminal kWideAscii{.width = 120, .height = 40};
const Terminal kWideUnicode{.unicode = true, .width = 120, .height = 40};

using test::joined;

void expect_holds(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words) EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
}

TEST(IdentifyView, AFrameShowsAllOfTheProgress) {
  const std::string text = joined(identify_frame(contact_progress(0.6), "", kWideUnicode));
  expect_holds(text, {"contact-7", "contact of sponge", "running", "Press deeper than 6 mm, slowly", "60 %",
                      "12.0 of 60 s", "7200 samples", "0.0791  ±   0.0012  N/mm^m", "1.634", "✘ steady",
                      "✘ certain", "covered", "residual 4.1 %", "displacement from 6 to 7 mm",
                      "the sensor was saturated", "measured", "model", "force / N", "speed / (mm/s)"});
}

TEST(IdentifyView, AFrameFitsEveryTerminal) {
  v1::IdentificationProgress crowded = contact_progress(0.7);
  for (int i = 0; i < 30; ++i) {
    *crowded.add_parameters() = crowded.parameters(0);
    crowded.add_missing("something");
    crowded.add_remarks("something else");
    if (i < 4) *crowded.add_coverage() = crowded.coverage(0);
  }
  for (const auto& progress : {crowded, contact_progress(0.0), v1::IdentificationProgress()}) {
    for (const int width : {40, 80, 120, 250}) {
      for (const int height : {24, 30, 60}) {
        const Terminal terminal{.color = true, .unicode = true, .width = width, .height = height};
        const auto lines = identify_frame(progress, "", terminal);
        EXPECT_LT(lines.size(), static_cast<std::size_t>(height)) << width << " x " << height;
        // The live screen cuts lines, but plots must not need it.
        for (const auto& line : lines) {
          EXPECT_EQ(line.find('\n'), std::string::npos);
          if (width < 120) continue;
          EXPECT_LE(display_width(line), static_cast<std::size_t>(width)) << line;
        }
      }
    }
  }
}

TEST(IdentifyView, HowManyMoreAreMissingIsNotCut) {
  v1::IdentificationProgress progress = contact_progress(0.4);
  progress.clear_missing();
  for (int i = 0; i < 4; ++i) {
    progress.add_missing("hold still for a second under 1.2 N or more, then press again (0.2 s so far)");
  }
  const auto lines = identify_frame(progress, "", {.unicode = true, .width = 80, .height = 24});
  const auto missing = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("hold still") != std::string::npos;
  });
  ASSERT_NE(missing, lines.end());
  EXPECT_TRUE(missing->ends_with("(and 3 more)")) << *missing;
  EXPECT_LE(display_width(*missing), 80U);
}

TEST(IdentifyView, TheInstructionIsBoxedAndBrokenIntoLines) {
  v1::IdentificationProgress progress = contact_progress(0.2);
  progress.set_instruction("Tap the object at 40 mm/s and let go at once; five times at places apart");
  const auto lines = identify_frame(progress, "", {.width = 44, .height = 40});
  ASSERT_GT(lines.size(), 6U);
  EXPECT_EQ(lines[1], "+" + std::string(42, '=') + "+");
  EXPECT_EQ(lines[2], "|  Tap the object at 40 mm/s and let go    |");
  EXPECT_EQ(lines[3], "|  at once; five times at places apart     |");
  EXPECT_EQ(lines[4], lines[1]);
}

TEST(IdentifyView, ALostConnectionTakesThePlaceOfTheInstruction) {
  const std::string text =
      joined(identify_frame(contact_progress(0.4), "connection lost, trying again", kWideAscii));
  expect_holds(text, {"connection lost, trying again"});
  EXPECT_EQ(text.find("Press deeper"), std::string::npos);
}

TEST(IdentifyView, TheCoverageAndTheFitAreSideBySideWhereThereIsRoom) {
  const auto rows_with = [](const std::vector<std::string>& lines) {
    return std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
      return line.find("speed / (mm/s)") != std::string::npos && line.find("force / N") != std::string::npos;
    });
  };
  EXPECT_EQ(rows_with(identify_frame(contact_progress(0.6), "", kWideUnicode)), 1);
  EXPECT_EQ(
      rows_with(identify_frame(contact_progress(0.6), "", {.unicode = true, .width = 60, .height = 50})), 0);
}

TEST(IdentifyView, TheFitIsDrawnWithoutNaN) {
  v1::IdentificationProgress progress = contact_progress(0.6);
  progress.mutable_fit(3)->set_measured(std::numeric_limits<double>::quiet_NaN());
  progress.mutable_fit(4)->set_x(std::numeric_limits<double>::infinity());
  EXPECT_EQ(draw_fit(progress, 60, 12, kWideUnicode).size(), 12U);
  EXPECT_TRUE(draw_fit({}, 60, 12, kWideUnicode).empty());
  v1::IdentificationProgress single;
  single.add_fit();  // one point at the origin
  EXPECT_EQ(draw_fit(single, 60, 12, kWideUnicode).size(), 12U);
}

TEST(IdentifyView, LabelsHaveTheirUnitsAsInTheOtherPlots) {
  EXPECT_EQ(plot_label("displacement [mm]"), "displacement / mm");
  EXPECT_EQ(plot_label("speed [mm/s]"), "speed / (mm/s)");
  EXPECT_EQ(plot_label("force / N"), "force / N");
  EXPECT_EQ(plot_label("proportional gain"), "proportional gain");
}

TEST(IdentifyView, ALargeRelativeErrorIsWrittenOut) {
  v1::IdentificationProgress progress = contact_end(v1::IDENTIFICATION_STATE_PARTIAL);
  progress.mutable_parameters(0)->set_standard_error(1.9 * 0.07912);
  progress.mutable_parameters(1)->set_standard_error(0.996 * 0.00042);
  progress.mutable_parameters(2)->set_standard_error(1e9);
  expect_holds(joined(identify_report(progress, false, kWideAscii)), {"(190 %)", "(100 %)", "(> 1000 %)"});
}

TEST(IdentifyView, APlainLineSaysTheSameWithoutEscapes) {
  const std::string line = identify_line(contact_progress(0.6), kWideAscii);
  expect_holds(line, {"12.0 s", "running", " 60 %", "stiffness 0.0791 +- 0.0012 N/mm^m",
                      "exponent 1.634 +- 0.021", "residual 4.1 %", "covered", "> Press deeper than 6 mm"});
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
}

TEST(IdentifyView, ATextOfTheDaemonCannotMoveTheCursor) {
  v1::IdentificationProgress progress = contact_progress(0.5);
  progress.set_instruction("press\x1b[2J now\nplease");
  progress.add_remarks("a\r\nb");
  for (const auto& line : identify_frame(progress, "", kWideAscii)) {
    EXPECT_EQ(line.find_first_of("\x1b\n\r"), std::string::npos) << line;
  }
  EXPECT_EQ(identify_line(progress, kWideAscii).find_first_of("\x1b\n\r"), std::string::npos);
}

TEST(IdentifyView, TheReportOfAModelSaysHowToLookAtItAndUseIt) {
  const auto progress = contact_end(v1::IDENTIFICATION_STATE_CONVERGED);
  const std::string text = joined(identify_report(progress, false, kWideAscii));
  expect_holds(text, {"contact-7  contact of sponge: converged after 20.0 s", "0.0791", "+ steady",
                      "+ certain", "+ covered 100 %", "3f9a12bc77aa0000",
                      "hapticctl model show 3f9a12bc77aa\n", "hapticctl model tag 3f9a12bc77aa current"});
  const std::string adopted = joined(identify_report(progress, true, kWideAscii));
  expect_holds(adopted, {"tagged current"});
  EXPECT_EQ(adopted.find("model tag"), std::string::npos);
}

TEST(IdentifyView, TheReportOfAPartialOneSaysWhatIsMissingAndIsNotAdopted) {
  const std::string text =
      joined(identify_report(contact_end(v1::IDENTIFICATION_STATE_PARTIAL), true, kWideAscii));
  expect_holds(text, {"partial", "missing", "displacement from 3 to 7 mm at 20 to 40 mm/s",
                      "marked as not converged", "hapticctl model tag 3f9a12bc77aa current"});
  EXPECT_EQ(text.find("tagged current"), std::string::npos);
}

TEST(IdentifyView, TheReportOfAFailureSaysWhy) {
  const std::string text =
      joined(identify_report(contact_end(v1::IDENTIFICATION_STATE_FAILED), false, kWideAscii));
  expect_holds(text, {"failed", "the guard stopped the device", "hapticctl clear", "none was kept"});
}

TEST(IdentifyView, AThresholdThatNoSceneTakesIsNotOffered) {
  v1::IdentificationProgress progress = contact_end(v1::IDENTIFICATION_STATE_PARTIAL);
  progress.set_kind("threshold");
  progress.mutable_parameters(0)->set_name("threshold_n");
  progress.mutable_parameters(0)->set_value(1.2);
  const std::string refused = joined(identify_report(progress, false, kWideAscii));
  expect_holds(refused, {"would not take a threshold of 1.20 N", "identify again with the tool free"});
  EXPECT_EQ(refused.find("model tag"), std::string::npos) << refused;
  progress.mutable_parameters(0)->set_value(0.03);
  expect_holds(joined(identify_report(progress, false, kWideAscii)), {"model tag"});
}

TEST(IdentifyView, WhatTheSearchForGainsDidNotReachIsABound) {
  v1::IdentificationProgress progress = contact_end(v1::IDENTIFICATION_STATE_CONVERGED);
  for (const char* name : {"ultimate_gain", "ultimate_period_ms", "lowest_holding_gain"}) {
    v1::EstimatedParameter& parameter = *progress.add_parameters();
    parameter.set_name(name);
    parameter.set_value(name[0] == 'l' ? 0.3 : 2.0);
    parameter.set_standard_error(std::numeric_limits<double>::infinity());
  }
  const std::string report = joined(identify_report(progress, false, kWideAscii));
  EXPECT_EQ(report.find("inf"), std::string::npos) << report;
  expect_holds(identify_line(progress, kWideAscii),
               {"ultimate_gain >= 2", "ultimate_period_ms -", "lowest_holding_gain <= 0.3"});
  expect_holds(identify_line(progress, kWideUnicode), {"ultimate_gain ≥ 2"});
}

TEST(IdentifyView, AnUndeterminedParameterIsShown) {
  v1::IdentificationProgress progress = contact_end(v1::IDENTIFICATION_STATE_PARTIAL);
  progress.mutable_parameters(1)->set_standard_error(std::numeric_limits<double>::infinity());
  expect_holds(joined(identify_report(progress, false, kWideAscii)), {"inf"});
}

}  // namespace
}  // namespace hapticd::cli
