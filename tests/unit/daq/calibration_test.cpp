// Calibration files: both versions, units, transforms, and everything that may be wrong with one.

#include "hal/daq/calibration.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <string>

#include "tests/emulators/board/gauge_emulator.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::daq {
namespace {

using emulators::CalibrationFileStyle;
using emulators::GaugeEmulator;

/// The file's text with one piece of it replaced; fails when it is not there.
std::string with(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

std::string file(const CalibrationFileStyle& style = {}) {
  return GaugeEmulator().calibration_file(style);
}

double largest_difference(const Calibration& calibration) {
  const GaugeEmulator gauges;
  double largest = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      largest = std::max(largest, std::abs(calibration.matrix[i][j] - gauges.load_per_volt()[i][j]));
    }
  }
  return largest;
}

TEST(Calibration, UserAxesAreTheMatrix) {
  const auto calibration = test::value_of(parse_calibration(file(), "made up"));
  EXPECT_LT(largest_difference(calibration), 1e-11);
  EXPECT_EQ(calibration.serial, "FT00042");
  EXPECT_EQ(calibration.body_style, "Nano17");
  EXPECT_EQ(calibration.part_number, "SI-25-0.25");
  EXPECT_EQ(calibration.file_version, "1.1");
  EXPECT_DOUBLE_EQ(calibration.output_low_v, -10.0);
  EXPECT_DOUBLE_EQ(calibration.output_high_v, 10.0);
  EXPECT_DOUBLE_EQ(calibration.max_load[2], 35.0);
  EXPECT_DOUBLE_EQ(calibration.max_load[5], 250.0);
  EXPECT_TRUE(calibration.notes.empty());
}

// A file of version 1.1 holds both forms; asked to be 1.0 its axes must lead to the same matrix.
TEST(Calibration, AxesScalesAndTransformMakeTheSameMatrix) {
  for (const auto& turn : {std::array<double, 3>{}, std::array<double, 3>{10.0, -25.0, 130.0}}) {
    for (const auto& shift :
         {std::array<double, 3>{0.0, 0.0, 6.096}, std::array<double, 3>{1.5, -2.5, 4.0}}) {
      CalibrationFileStyle style{.transform = {shift, turn}};
      const std::string text = with(file(style), "CalFileVersion=\"1.1\"", "CalFileVersion=\"1.0\"");
      const auto calibration = test::value_of(parse_calibration(text, "made up"));
      EXPECT_LT(largest_difference(calibration), 1e-6) << "the scales have seven decimals";
    }
  }
}

TEST(Calibration, VersionOneHoldsNoUserAxes) {
  const std::string text = file({.version = "1.0"});
  ASSERT_EQ(text.find("UserAxis"), std::string::npos);
  const auto calibration = test::value_of(parse_calibration(text, "made up"));
  EXPECT_LT(largest_difference(calibration), 1e-6);
  // Left out, the transform is missed.
  const auto unmoved = test::value_of(parse_calibration(with(text, "Dz=\"6.096", "Dz=\"0.000"), "made up"));
  EXPECT_GT(largest_difference(unmoved), 1.0);
}

TEST(Calibration, FiveDecimalsAsTheMakerPrintsThemAreGoodForATenthOfAPercent) {
  CalibrationFileStyle style{.version = "1.0", .decimals = 5};
  const auto calibration = test::value_of(parse_calibration(file(style), "made up"));
  EXPECT_LT(largest_difference(calibration), 1e-3 * 25.0);
}

TEST(Calibration, UnitsAreConverted) {
  for (const char* version : {"1.0", "1.1"}) {
    CalibrationFileStyle style{.version = version, .newton_metres = true};
    const auto calibration = test::value_of(parse_calibration(file(style), "made up"));
    EXPECT_LT(largest_difference(calibration), 1e-6);
    EXPECT_NEAR(calibration.max_load[3], 250.0, 1e-9);
  }
  const auto pounds =
      test::value_of(parse_calibration(with(file(), "ForceUnits=\"N\"", "ForceUnits=\"lbf\""), "made up"));
  EXPECT_NEAR(pounds.matrix[2][0] / GaugeEmulator().load_per_volt()[2][0], 4.4482216152605, 1e-9);
  const auto inches =
      parse_calibration(with(file(), "TorqueUnits=\"N-mm\"", "TorqueUnits=\"in-lb\""), "made up");
  ASSERT_TRUE(inches);
  EXPECT_NEAR(inches->matrix[4][1] / GaugeEmulator().load_per_volt()[4][1], 112.984829, 1e-5);
}

TEST(Calibration, AUnipolarRangeStartsAtZero) {
  const auto calibration =
      parse_calibration(with(file(), "OutputBipolar=\"True\"", "OutputBipolar=\"False\""), "made up");
  ASSERT_TRUE(calibration);
  EXPECT_DOUBLE_EQ(calibration->output_low_v, 0.0);
  EXPECT_DOUBLE_EQ(calibration->output_high_v, 20.0);
}

TEST(Calibration, TemperatureCompensationInSoftwareIsNoted) {
  const auto calibration = test::value_of(parse_calibration(
      with(file(), "<UserAxis Name=\"Fx\"", "<BiasSlope values=\"0 0 0 0 0 0\"/><UserAxis Name=\"Fx\""),
      "made up"));
  ASSERT_EQ(calibration.notes.size(), 1U);
  EXPECT_NE(calibration.notes[0].find("temperature"), std::string::npos);
}

TEST(Calibration, OneOfSeveralIsChosenByPartNumber) {
  const std::string one = file();
  const std::size_t from = one.find("\t<Calibration");
  const std::size_t to = one.find("</FTSensor>");
  const std::string second =
      with(one.substr(from, to - from), "PartNumber=\"SI-25-0.25\"", "PartNumber=\"SI-12-0.12\"");
  const std::string both =
      one.substr(0, to) + with(second, "max=\"35.000000\"", "max=\"17\"") + "</FTSensor>";
  EXPECT_NE(test::error_of(parse_calibration(both, "made up")).text().find("part_number"), std::string::npos);
  const auto small = test::value_of(parse_calibration(both, "made up", "SI-12-0.12"));
  EXPECT_EQ(small.part_number, "SI-12-0.12");
  EXPECT_NE(test::error_of(parse_calibration(both, "made up", "SI-50-0.5")).limit.find("SI-12-0.12"),
            std::string::npos);
}

TEST(Calibration, WhatIsWrongIsRefusedByName) {
  struct Flaw {
    const char* what;
    const char* by;
    const char* complaint;  ///< named by the refusal
    const char* place;      ///< named too
  };
  const Flaw flaws[] = {
      {"<FTSensor ", "<Sensor ", "", "made up"},
      {"CalFileVersion=\"1.1\"", "CalFileVersion=\"2.0\"", "2.0", "CalFileVersion"},
      {"CalFileVersion=\"1.1\"", "", "CalFileVersion", "FTSensor"},
      {"NumGages=\"6\"", "NumGages=\"7\"", "NumGages", "7"},
      {"NumGages=\"6\"", "NumGages=\"six\"", "NumGages", "six"},
      {"ForceUnits=\"N\"", "ForceUnits=\"dyn\"", "ForceUnits", "dyn"},
      {"TorqueUnits=\"N-mm\"", "TorqueUnits=\"N/mm\"", "TorqueUnits", "N/mm"},
      {"ForceUnits=\"N\"", "", "ForceUnits", "Calibration"},
      {"OutputRange=\"20\"", "", "OutputRange", "Calibration"},
      {"OutputRange=\"20\"", "OutputRange=\"-20\"", "OutputRange", "-20"},
      {"OutputBipolar=\"True\"", "OutputBipolar=\"Perhaps\"", "OutputBipolar", "Perhaps"},
      {"<UserAxis Name=\"Ty\"", "<Axes Name=\"Ty\"", "missing", "UserAxis Ty"},
      {"<UserAxis Name=\"Ty\"", "<UserAxis Name=\"Tx\"", "twice", "UserAxis Tx"},
      {"<UserAxis Name=\"Ty\"", "<UserAxis Name=\"Qy\"", "unknown axis", "UserAxis Qy"},
      {"<UserAxis Name=\"Ty\"", "<UserAxis Title=\"Ty\"", "Name", "UserAxis"},
      {"<UserAxis Name=\"Fz\" values=", "<UserAxis Name=\"Fz\" numbers=", "values", "UserAxis Fz"},
      {"<UserAxis Name=\"Fz\" values=\"", "<UserAxis Name=\"Fz\" values=\"0.5 ", "6 finite", "UserAxis Fz"},
      {"<UserAxis Name=\"Fz\" values=\"", "<UserAxis Name=\"Fz\" values=\"a", "6 finite", "UserAxis Fz"},
      {"<UserAxis Name=\"Fz\" values=\" ", "<UserAxis Name=\"Fz\" values=\" nan1 ", "6 finite",
       "UserAxis Fz"},
  };
  for (const Flaw& flaw : flaws) {
    SCOPED_TRACE(flaw.by);
    const hal::Error refused = test::error_of(parse_calibration(with(file(), flaw.what, flaw.by), "made up"));
    EXPECT_EQ(refused.code, hal::ErrorCode::kMalformed);
    const std::string text = refused.text();
    EXPECT_NE(text.find(flaw.complaint), std::string::npos) << text;
    EXPECT_NE(text.find(flaw.place), std::string::npos) << text;
    EXPECT_NE(text.find("made up"), std::string::npos) << text;
    EXPECT_FALSE(refused.remedy.empty());
  }
}

/// A file whose six rows of numbers are these.
std::string with_rows(const std::array<const char*, 6>& rows, const char* version = "1.1") {
  std::string text = "<FTSensor NumGages=\"6\" CalFileVersion=\"" + std::string(version) +
                     "\"><Calibration ForceUnits=\"N\" TorqueUnits=\"N-mm\" DistUnits=\"mm\" "
                     "OutputRange=\"20\" OutputBipolar=\"True\">";
  const char* const names[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::string element = std::string(version) == "1.0" ? "Axis" : "UserAxis";
    text += "<" + element + " Name=\"" + names[i] + "\" values=\"" + rows[i] + "\"/>";
  }
  return text + "</Calibration></FTSensor>";
}

TEST(Calibration, PlainRowsWithoutAnythingOptionalWillDo) {
  for (const char* version : {"1.0", "1.1"}) {
    const auto calibration =
        test::value_of(parse_calibration(with_rows({"+1 0 0 0 0 0", "0\t2 0 0 0 0", "0 0 3e0 0 0 0",
                                                    "0 0 0 -4 0 0", "0 0 0 0 5 0\n", " 0 0 0 0 0 6"},
                                                   version),
                                         "plain"));
    EXPECT_DOUBLE_EQ(calibration.matrix[0][0], 1.0);
    EXPECT_DOUBLE_EQ(calibration.matrix[3][3], -4.0);
  }
}

TEST(Calibration, ASingularOrMeaninglessMatrixIsRefused) {
  const std::array<std::array<const char*, 6>, 4> all = {{
      {"1 0 0 0 0 0", "1 0 0 0 0 0", "0 0 1 0 0 0", "0 0 0 1 0 0", "0 0 0 0 1 0", "0 0 0 0 0 1"},
      {"1 0 0 0 0 0", "0 1 0 0 0 0", "0 0 0 0 0 0", "0 0 0 1 0 0", "0 0 0 0 1 0", "0 0 0 0 0 1"},
      {"1 0 0 0 0 0", "0 1 0 0 0 0", "1 1 0 0 0 0", "0 0 0 1 0 0", "0 0 0 0 1 0", "0 0 0 0 0 1"},
      {"0 0 0 0 0 0", "0 0 0 0 0 0", "0 0 0 0 0 0", "0 0 0 0 0 0", "0 0 0 0 0 0", "0 0 0 0 0 0"},
  }};
  for (const auto& rows : all) {
    EXPECT_NE(test::error_of(parse_calibration(with_rows(rows), "flat")).text().find("singular"),
              std::string::npos);
  }
  const hal::Error huge =
      test::error_of(parse_calibration(with_rows({"1e300 0 0 0 0 0", "0 1 0 0 0 0", "0 0 1 0 0 0",
                                                  "0 0 0 1 0 0", "0 0 0 0 1 0", "0 0 0 0 0 1"}),
                                       "huge"));
  EXPECT_NE(huge.text().find("UserAxis Fx"), std::string::npos);
}

TEST(Calibration, VersionOneIsCheckedToo) {
  using enum hal::ErrorCode;
  const std::string text = file({.version = "1.0"});
  test::expect_refusals(
      {
          {with(text, "scale=\"5.8934167", "scale=\"0\" was=\""), "Axis Fz", kMalformed},
          {with(text, "DistUnits=\"mm\"", "DistUnits=\"yd\""), "DistUnits", kMalformed},
          {with(text, "Dz=\"6.096", "Dz=\"inf"), "BasicTransform", kMalformed},
          {with(text, "DistUnits=\"mm\"", "DistUnits=\"mm\" AngleUnits=\"gon\""), "AngleUnits", kMalformed},
      },
      [](const std::string& one) { return parse_calibration(one, "made up"); });
}

TEST(Calibration, TruncatedOrForeignBytesAreRefused) {
  const std::string whole = file();
  for (std::size_t length = 0; length + 12 < whole.size(); length += 37) {
    EXPECT_FALSE(parse_calibration(std::string_view(whole).substr(0, length), "cut")) << length;
  }
  EXPECT_FALSE(parse_calibration("", "empty"));
  EXPECT_FALSE(parse_calibration(std::string(1000, '\0'), "zeros"));
  EXPECT_FALSE(parse_calibration("<FTSensor/>", "bare"));
}

TEST(Calibration, FilesAreReadAndMissingOnesNamed) {
  using enum hal::ErrorCode;
  const test::TemporaryFolder folder;
  const auto calibration = test::value_of(load_calibration(folder.write("sensor.cal", file())));
  const std::string pipe = folder.path("pipe.cal");  // without a writer
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  test::expect_refusals(
      {
          {folder.path("other.cal"), "other.cal", kUnreadable},
          {folder.write("large.cal", std::string((1U << 20U) + 10, ' ')), "large.cal", kTooLong},
          {folder.path(), folder.path(), kUnreadable},
          {pipe, pipe, kUnreadable},
      },
      [](const std::string& path) { return load_calibration(path); });
}

}  // namespace
}  // namespace hapticd::daq
