// What a recording file must look like, and how one that does not is refused.

#include "replay_file.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "hal/replay/csv_file.h"
#include "hal/replay/recording.h"
#include "hal/replay/replay_rig.h"
#include "tests/support/value_of.h"

namespace hapticd::replay {
namespace {

using test::ReplayFile;

hal::Result<Recording> load(std::string_view content, const RecordingColumns& columns = {},
                            const CsvFormat& format = {}) {
  const ReplayFile file(content);
  return load_recording(file.path(), columns, format);
}

/// The refusal's text without the place's path, which differs from machine to machine.
std::string refusal(std::string_view content, const RecordingColumns& columns = {}) {
  const ReplayFile file(content);
  const auto recording = load_recording(file.path(), columns);
  if (recording) return "accepted";
  std::string text = recording.error().text();
  if (const auto at = text.find(file.path()); at != std::string::npos)
    text.replace(at, file.path().size(), "FILE");
  return text;
}

TEST(ReplayColumns, AreFoundByNameAndUnitSuffix) {
  const auto recording =
      test::value_of(load("time_ms,load_mN,ignored,tip_um\n0,500,text is fine here,0\n100,1500,,2000\n"));
  EXPECT_DOUBLE_EQ(recording.time_s[1], 0.1);
  EXPECT_DOUBLE_EQ(recording.force_n[1], 1.5);
  EXPECT_DOUBLE_EQ(recording.depth_mm[1], 2.0);
}

TEST(ReplayColumns, AreMappedByNameUnitAndScale) {
  RecordingColumns columns;
  columns.time = {.column = "clock", .unit = "ms", .scale = 1.0};
  columns.force = {.column = "load_uN", .unit = "", .scale = 1e6};
  columns.position = {.column = "z_m", .unit = "um", .scale = -1.0};
  const auto recording = test::value_of(load("z_m,clock,load_uN\n1000,0,0.25\n2000,10,0.5\n", columns));
  EXPECT_DOUBLE_EQ(recording.time_s[1], 0.01);
  EXPECT_DOUBLE_EQ(recording.force_n[1], 0.5);
  EXPECT_DOUBLE_EQ(recording.depth_mm[1], -2.0) << "the mapping's unit goes before the name's";
}

TEST(ReplayColumns, WithoutUnitInTheNameTakeTheMappings) {
  RecordingColumns columns;
  columns.time.unit = "ms";
  const auto recording = test::value_of(load("time,force_N,position_mm\n0,0,0\n5,1,1\n", columns));
  EXPECT_DOUBLE_EQ(recording.time_s[1], 0.005);
}

TEST(ReplayFileFormat, AllowsCommentsBlankLinesCrlfBomAndSigns) {
  const auto recording = test::value_of(
      load("\xEF\xBB\xBF# a comment\r\ntime_s, force_N ,depth_mm\r\n\r\n0,+0.1,-1e-3\r\n  # another\r\n 0.1 "
           ",\t0.2,0\r\n\r\n"));
  ASSERT_EQ(recording.time_s.size(), 2U);
  EXPECT_DOUBLE_EQ(recording.force_n[0], 0.1);
  EXPECT_DOUBLE_EQ(recording.depth_mm[0], -1e-3);
}

TEST(ReplayFileFormat, CountsTimeFromTheFirstRow) {
  const auto recording =
      test::value_of(load("time_s,force_N,depth_mm\n1700000000.5,0,0\n1700000001.5,0,0\n"));
  EXPECT_DOUBLE_EQ(recording.time_s[0], 0.0);
  EXPECT_DOUBLE_EQ(recording.duration_s(), 1.0);
}

std::string utf16(std::string_view ascii, bool big, bool mark) {
  std::string text;
  const auto unit = [&](char high, char low) {
    text += big ? std::string{high, low} : std::string{low, high};
  };
  if (mark) unit('\xFE', '\xFF');
  for (const char c : ascii) unit('\0', c);
  return text;
}

/// Formats in which other programs write the same two rows, 0 s, 0 N, 0 mm and 0.5 s, 2 N, 3 mm.
TEST(ReplayFileFormat, OfOtherMachinesIsReadAsItIs) {
  const std::string plain = "time_s,force_N,depth_mm\n0,0,0\n0.5,2,3\n";
  struct Machine {
    std::string content;
    bool decimal_comma = false;
  };
  const Machine machines[] = {
      {"time_s,force_N,depth_mm\ns,N,mm\n0,0,0\n0.5,2,3\n"},
      {"Time,Force,Extension\n(s),(N),(mm)\n0,0,0\n0.5,2,3\n"},
      {"\"Time\",\"Load\",\"Displacement\"\n\"sec\",\"kN\",\"mm\"\n\"0\",\"0\",\"0\"\n\"0.5\",\"0.002\","
       "\"3\"\n"},
      {"Specimen,\"silicone, "
       "soft\"\nDate,2020-01-02\n\nRate,10,mm/min\nTime,Load,Extension\ns,N,mm\n0,0,0\n0.5,2,3\n"},
      {"Test,Peak,Width\nN,mm,\n7,2,10\n\ntime_s,force_N,depth_mm\n0,0,0\n0.5,2,3\n"},
      {"time_s,force_kN,depth_mm\n0,0,0\n0.5,0.002,3\n"},
      {"Zeit [s],Kraft [kN],Weg [mm]\n0,0,0\n0.5,0.002,3\n"},
      {"t/ms,F/N,depth/mm\n0,0,0\n500,2,3\n"},
      {"Zeit in s,Standardkraft in N,Standardweg in mm\n0,0,0\n0.5,2,3\n"},
      {"Time (sec.),FORCE (MN),Tip {\u03bcm}\n0,0,0\n0.5,2e-6,3000\n"},
      {"Time (MS),Force (mN),tip_\u00b5m\n0,0,0\n500,2000,3000\n"},
      {"time_s,force_N,depth_\xB5m\n0,0,0\n0.5,2,3000\n"},
      {"Elapsed Time (s);Load (N);Crosshead (mm);note;\n0;0;0;;\n0.5;2;3;\"a;b\"\n"},
      {"time_s\tforce_N\tdepth_mm\tnote\t\n0\t0\t0\t\t\n0.5\t2\t3\t\t\n"},
      {"time_s,force_N,depth_mm,,\n0,0,0,,\n0.5,2,3,,\n"},
      {"Zeit;Kraft;Weg\ns;N;mm\n0,0;0,0;0,00\n0,5;2,0;+3,0e0\n", true},
      {"\"time_s\",\"force_N\",\"depth_mm\"\n\"0,0\",\"0\",\"0\"\n\"0,5\",\"2\",\"3\"\n", true},
      {"time_s,force_N,depth_mm\r0,0,0\r0.5,2,3\r"},
      {"time_s,force_N,depth_mm\r\n0,0,0\r\n0.5,2,3\r\n1.0,2"},
      {"time_s,force_N,depth_mm\n0,0,0\n0.5,2,3\n1.0,2,3e"},
      {plain + std::string("1.0,2\0\0\0\0", 9)},
      {utf16(plain, false, true)},
      {utf16(plain, true, true)},
      {utf16(plain, false, false)},
      {utf16(plain, true, false)},
  };
  for (const Machine& machine : machines) {
    SCOPED_TRACE(machine.content);
    const auto recording =
        test::value_of(load(machine.content, {}, {.decimal_comma = machine.decimal_comma}));
    ASSERT_EQ(recording.time_s.size(), 2U);
    EXPECT_DOUBLE_EQ(recording.time_s[1], 0.5);
    EXPECT_NEAR(recording.force_n[1], 2.0, 1e-12);
    EXPECT_NEAR(recording.depth_mm[1], 3.0, 1e-12);
  }
}

TEST(ReplayColumns, HaveTheUnitsOfTheirTrade) {
  struct Case {
    const char* force;
    double force_n;
    const char* position;
    double depth_mm;
  };
  const Case cases[] = {
      {"Load [kgf]", 9.80665, "Extension (in)", 25.4},   {"force_g", 9.80665e-3, "tip_inch", 25.4},
      {"Force (gf)", 9.80665e-3, "Distance [cm]", 10.0}, {"Load, lbf", 4.4482216152605, "Stroke/mil", 0.0254},
      {"force_cN", 0.01, "position_um", 1e-3},           {"Kraft (daN)", 10.0, "Weg [m]", 1e3},
      {"FORCE (KN)", 1e3, "DISPLACEMENT (MM)", 1.0},     {"force kg", 9.80665, "depth \u03bcm", 1e-3},
  };
  for (const Case& one : cases) {
    const auto recording = load(std::string("time_s;") + one.force + ';' + one.position + "\n0;0;0\n1;1;1\n");
    ASSERT_TRUE(recording) << recording.error().text();
    EXPECT_DOUBLE_EQ(recording->force_n[1], one.force_n) << one.force;
    EXPECT_DOUBLE_EQ(recording->depth_mm[1], one.depth_mm) << one.position;
  }
}

TEST(ReplayColumns, OfARowOfUnitsAreMappedByTheirNameAlone) {
  RecordingColumns columns;
  columns.force.column = "Load 2";
  const auto recording =
      test::value_of(load("Time,Load,Load 2,Extension\ns,N,kN,mm\n0,0,0,0\n1,1,5,1\n", columns));
  EXPECT_DOUBLE_EQ(recording.force_n[1], 5000.0);
}

struct BadFile {
  std::string_view content;
  RecordingColumns columns;
  std::string where;  ///< in the file
  hal::ErrorCode code;
};

TEST(ReplayBadFile, IsRefusedWithItsPlace) {
  using enum hal::ErrorCode;
  const BadFile files[] = {
      {"", {}, "", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,0\n", {}, "", kMalformed},
      {"time_s;force_N;depth_mm\n0;0;0\n", {}, "", kMalformed},
      {"\"time_s\",\"force_N\"\n", {}, "", kNotFound},
      {"time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
       {.time = {}, .force = {.column = "load_N"}, .position = {}},
       "",
       kNotFound},
      {"time_s,force_N,height\n0,0,0\n1,0,0\n", {}, "", kNotFound},
      {"time_s,force_N,depth_mm,position_mm\n0,0,0,0\n1,0,0,0\n", {}, "", kContradiction},
      {"time_s,force_N,force_N,depth_mm\n0,0,0,0\n1,0,0,0\n",
       {.time = {}, .force = {.column = "force_N"}, .position = {}},
       "",
       kContradiction},
      {"time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
       {.time = {}, .force = {.column = "force_N", .unit = "kip"}, .position = {}},
       ", column 'force_N'",
       kUnknownWord},
      {"time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
       {.time = {.column = "time_s", .unit = "mm"}, .force = {}, .position = {}},
       ", column 'time_s'",
       kUnknownWord},
      {"time_s,force_N,z\n0,0,0\n1,0,0\n",
       {.time = {}, .force = {}, .position = {.column = "z"}},
       ", column 'z'",
       kUnknownWord},
      {"time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
       {.time = {}, .force = {.column = "force_N", .unit = "", .scale = 0.0}, .position = {}},
       "",
       kOutOfRange},
      {"time_s,force_N,depth_mm\n0,0,0\n# note\n1,0.5 N,0\n", {}, ", line 4, column 'force_N'", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,5,1,0\n", {}, ", line 2", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,0\n1,0\n", {}, ", line 3", kMalformed},
      {"time_s,force_N,depth_mm\n0,,0\n", {}, ", line 2, column 'force_N'", kMalformed},
      {"time_s,force_N,depth_mm\n\"0,0,0\n", {}, ", line 2, column 'time_s'", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,0\n1,NaN,0\n", {}, ", line 3, column 'force_N'", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,-1e999\n", {}, ", line 2, column 'depth_mm'", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,0\n0.1,0,0\n0.1,0,0\n", {}, ", line 4", kMalformed},
      {"time_s,force_N,depth_mm\n5,0,0\n4,0,0\n", {}, ", line 3", kMalformed},
      {"time_s,force_N,depth_mm\n0,0,0\n1e12,0,0\n", {}, ", line 3", kTooLong},
      {"time_s,force_N,depth_mm\n0,1e308,0\n1,0,0\n",
       {.time = {}, .force = {.column = "force_N", .unit = "", .scale = 1e9}, .position = {}},
       ", line 2",
       kNotFinite},
      {std::string_view("time_s,force_N,depth_mm\n\0\x01,0,0\n", 31),
       {},
       ", line 2, column 'time_s'",
       kMalformed},
  };
  for (const BadFile& bad : files) {
    SCOPED_TRACE(bad.content);
    const ReplayFile file(bad.content);
    const auto recording = load_recording(file.path(), bad.columns);
    ASSERT_FALSE(recording);
    EXPECT_EQ(recording.error().where, "recording '" + file.path() + "'" + bad.where);
    EXPECT_EQ(static_cast<int>(recording.error().code), static_cast<int>(bad.code))
        << recording.error().text();
  }
}

TEST(ReplayBadFile, ARefusalHasFiveParts) {
  EXPECT_EQ(
      refusal("time_s,force_N,depth_mm\n0,0,0\n# note\n1,0.5 N,0\n"),
      "recording 'FILE', line 4, column 'force_N': the cell is not a number (got '0.5 N'); accepted: finite "
      "numbers such as 0.015 or 1.5e-3; write the unit into the column's name, as in force_N");
  // Bytes that cannot be printed are replaced.
  EXPECT_NE(refusal(std::string_view("time_s,force_N,depth_mm\n\0\x01,0,0\n", 31)).find("(got '?\?')"),
            std::string::npos);
}

TEST(ReplayBadFile, Hdf5IsRecognised) {
  using namespace std::string_view_literals;
  EXPECT_EQ(
      refusal("\x89HDF\r\n\x1a\n\0\0\n"sv),
      "recording 'FILE': this is an HDF5 file; accepted: MCAP or CSV; give the .mcap (hapticctl record get), "
      "or the CSV (hapticctl record export)");
}

TEST(ReplayBadFile, ARefusalSaysWhatHelps) {
  struct Case {
    std::string_view content;
    std::string_view part;
    bool decimal_comma = false;
  };
  const Case cases[] = {
      {"time_s;force_N;depth_mm\n0,0;0,0;0,0\n0,5;1,5;1,5\n", "--decimal-comma"},
      {"time_s;force_N;depth_mm\n0,0;0,0;0,0\n0,5;1,5;1,5\n", "?decimal_comma=true"},
      {"time_s,force_N,depth_mm\n0,0,0,0,0,0\n0,5,1,5,1,5\n", "export it with semicolons"},
      {"time_s;force_N;depth_mm\n0;0;0\n0,5;1.000,5;1\n", "separators of thousands", true},
      {"time_s,force_N,depth_mm\n0,0,0\n0.5,0,0\n0.5,0,0\n", "keep one row of each time"},
      {"time_s,force_N,depth_mm\n0,0,0\n0.5,0,0\n0.4,0,0\n", "sort the rows"},
      {"Time (hh:mm),force_N,depth_mm\n0,0,0\n1,0,0\n", "(got 'hh:mm'); accepted: s, ms"},
      {"time_s,force_N,depth_mm\n00:00:01,0,0\n00:00:02,0,0\n", "export the time in seconds"},
      {"time_s,Force (kip),depth_mm\n0,0,0\n1,0,0\n", "(got 'kip'); accepted: N, mN"},
      {"time_s,Force (mn),depth_mm\n0,0,0\n1,0,0\n", "(got 'mn'); accepted: N, mN"},
      {"time_s,Force,depth_mm\n0,0,0\n1,0,0\n", "--column force=NAME:UNIT"},
      {"time_s,force_N,depth_mm\ns,kN,mm\n0,0,0\n1,0,0\n", "the file's columns are time_s, force_N [kN]"},
      {"time_s,voltage_V,depth_mm\n0,0,0\n1,0,0\n", "'replay:FILE?force=NAME&force_unit=UNIT'"},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.content);
    const hal::Error refused = test::error_of(load(one.content, {}, {.decimal_comma = one.decimal_comma}));
    EXPECT_NE(refused.text().find(one.part), std::string::npos) << refused.text();
  }
}

TEST(ReplayBadPath, MissingFileIsNamed) {
  const hal::Error refused = test::error_of(ReplayRig::open({.path = "/no/such/recording.csv"}));
  EXPECT_EQ(refused.where, "recording '/no/such/recording.csv'");
  EXPECT_EQ(refused.code, hal::ErrorCode::kNotFound);
}

TEST(ReplayBadPath, FolderIsNotARecording) {
  const hal::Error refused = test::error_of(ReplayRig::open({.path = "/"}));
  EXPECT_EQ(refused.where, "recording '/'");
  EXPECT_EQ(refused.code, hal::ErrorCode::kUnreadable);
}

TEST(ReplayBadPath, LineWithoutEndIsRefusedInBoundedMemory) {
  std::string content = "time_s,force_N,depth_mm\n";
  content.append(2 * TextLines::kMaxLineBytes, '1');
  EXPECT_EQ(test::error_of(load(content)).code, hal::ErrorCode::kTooLong);
}

TEST(ReplayBadPath, RateAndBiasHaveARange) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n1,0,0\n");
  const hal::Error fast = test::error_of(ReplayRig::open({.path = file.path(), .rate_hz = 1e6}));
  EXPECT_EQ(fast.code, hal::ErrorCode::kOutOfRange);
  const hal::Error biased = test::error_of(ReplayRig::open({.path = file.path(), .bias_s = 2.0}));
  EXPECT_EQ(biased.limit, "0 … 1 s");
  EXPECT_FALSE(ReplayRig::open({.path = file.path(), .bias_s = -1.0}));
}

}  // namespace
}  // namespace hapticd::replay
