// What a recording file must look like, and what is said of one that does not.

#include "replay_file.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "hal/replay/csv_file.h"
#include "hal/replay/recording.h"
#include "hal/replay/replay_rig.h"

namespace hapticd::replay {
namespace {

using test::ReplayFile;

hal::Result<Recording> load(std::string_view content, const RecordingColumns& columns = {}) {
  const ReplayFile file(content);
  return load_recording(file.path(), columns);
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
  const auto recording = load("time_ms,load_mN,ignored,tip_um\n0,500,text is fine here,0\n100,1500,,2000\n");
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_DOUBLE_EQ(recording->time_s[1], 0.1);
  EXPECT_DOUBLE_EQ(recording->force_n[1], 1.5);
  EXPECT_DOUBLE_EQ(recording->depth_mm[1], 2.0);
}

TEST(ReplayColumns, AreMappedByNameUnitAndScale) {
  RecordingColumns columns;
  columns.time = {.column = "clock", .unit = "ms", .scale = 1.0};
  columns.force = {.column = "load_uN", .unit = "", .scale = 1e6};
  columns.position = {.column = "z_m", .unit = "um", .scale = -1.0};
  const auto recording = load("z_m,clock,load_uN\n1000,0,0.25\n2000,10,0.5\n", columns);
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_DOUBLE_EQ(recording->time_s[1], 0.01);
  EXPECT_DOUBLE_EQ(recording->force_n[1], 0.5);
  EXPECT_DOUBLE_EQ(recording->depth_mm[1], -2.0) << "the mapping's unit goes before the name's";
}

TEST(ReplayColumns, WithoutUnitInTheNameTakeTheMappings) {
  RecordingColumns columns;
  columns.time.unit = "ms";
  const auto recording = load("time,force_N,position_mm\n0,0,0\n5,1,1\n", columns);
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_DOUBLE_EQ(recording->time_s[1], 0.005);
}

TEST(ReplayFileFormat, AllowsCommentsBlankLinesCrlfBomAndSigns) {
  const auto recording = load(
      "\xEF\xBB\xBF# a comment\r\ntime_s, force_N ,depth_mm\r\n\r\n0,+0.1,-1e-3\r\n  # another\r\n 0.1 "
      ",\t0.2,0\r\n\r\n");
  ASSERT_TRUE(recording) << recording.error().text();
  ASSERT_EQ(recording->time_s.size(), 2U);
  EXPECT_DOUBLE_EQ(recording->force_n[0], 0.1);
  EXPECT_DOUBLE_EQ(recording->depth_mm[0], -1e-3);
}

TEST(ReplayFileFormat, CountsTimeFromTheFirstRow) {
  const auto recording = load("time_s,force_N,depth_mm\n1700000000.5,0,0\n1700000001.5,0,0\n");
  ASSERT_TRUE(recording);
  EXPECT_DOUBLE_EQ(recording->time_s[0], 0.0);
  EXPECT_DOUBLE_EQ(recording->duration_s(), 1.0);
}

struct BadFile {
  const char* name;
  std::string_view content;
  RecordingColumns columns;
  std::string_view refusal;
};

class ReplayBadFile : public ::testing::TestWithParam<BadFile> {};

TEST_P(ReplayBadFile, IsRefusedInSoManyWords) {
  EXPECT_EQ(refusal(GetParam().content, GetParam().columns), GetParam().refusal);
}

// Each message on one line, as it is printed.
// clang-format off
const BadFile kBadFiles[] = {
    {"Empty", "", {}, "recording 'FILE': the file is empty; accepted: a header line and at least two rows"},
    {"OneRow",
     "time_s,force_N,depth_mm\n0,0,0\n",
     {},
     "recording 'FILE': the recording has fewer than two rows (got 1); accepted: at least 2 rows of numbers under the header"},
    {"Semicolons",
     "time_s;force_N;depth_mm\n0;0;0\n",
     {},
     "recording 'FILE', line 1: the columns are not separated by commas (got 'time_s;force_N;depth_mm'); accepted: ',' between columns and '.' as decimal point; export the file again with commas"},
    {"QuotedHeader",
     "\"time_s\",\"force_N\"\n",
     {},
     "recording 'FILE', line 1: the header has quoted names (got '\"time_s\",\"force_N\"'); accepted: plain names separated by commas; write the file without quotes"},
    {"MissingColumn",
     "time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
     {.time = {}, .force = {.column = "load_N"}, .position = {}},
     "recording 'FILE': no column has that name, for the force (got 'load_N'); accepted: the file's columns are time_s, force_N, depth_mm; map the force to one of these"},
    {"NoPosition",
     "time_s,force_N,height\n0,0,0\n1,0,0\n",
     {},
     "recording 'FILE': no column could be recognised as the position; accepted: the file's columns are time_s, force_N, height; map one by name; recognised are indentation, position, displacement, depth, tip followed by _ and a unit (mm, um, µm, nm, cm, m)"},
    {"TwoCandidates",
     "time_s,force_N,depth_mm,position_mm\n0,0,0,0\n1,0,0,0\n",
     {},
     "recording 'FILE': more than one column could be the position (got depth_mm, position_mm); map one of them by name"},
    {"NameTwice",
     "time_s,force_N,force_N,depth_mm\n0,0,0,0\n1,0,0,0\n",
     {.time = {}, .force = {.column = "force_N"}, .position = {}},
     "recording 'FILE': more than one column could be the force (got force_N, force_N); give the columns different names"},
    {"WrongUnit",
     "time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
     {.time = {}, .force = {.column = "force_N", .unit = "lbf"}, .position = {}},
     "recording 'FILE', column 'force_N': this is not a unit of force (got 'lbf'); accepted: N, mN, uN, µN, nN, n"},
    {"UnitOfAnotherQuantity",
     "time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
     {.time = {.column = "time_s", .unit = "mm"}, .force = {}, .position = {}},
     "recording 'FILE', column 'time_s': this is not a unit of time (got 'mm'); accepted: s, ms, us, µs, ns"},
    {"NoUnit",
     "time_s,force_N,z\n0,0,0\n1,0,0\n",
     {.time = {}, .force = {}, .position = {.column = "z"}},
     "recording 'FILE', column 'z': the column's name does not end in a unit of position; accepted: mm, um, µm, nm, cm, m; name the unit in the mapping"},
    {"ZeroScale",
     "time_s,force_N,depth_mm\n0,0,0\n1,0,0\n",
     {.time = {}, .force = {.column = "force_N", .unit = "", .scale = 0.0}, .position = {}},
     "recording 'FILE': the scale of the force is not valid (got 0); accepted: finite and not zero; negative reverses the sign"},
    {"Text",
     "time_s,force_N,depth_mm\n0,0,0\n# note\n1,0.5 N,0\n",
     {},
     "recording 'FILE', line 4, column 'force_N': the cell is not a number (got '0.5 N'); accepted: finite numbers such as 0.015 or 1.5e-3"},
    {"DecimalComma",
     "time_s,force_N,depth_mm\n0,0,5,1,0\n",
     {},
     "recording 'FILE', line 2: the row does not have the header's number of cells (got 5); accepted: 3 cells"},
    {"ShortRow",
     "time_s,force_N,depth_mm\n0,0,0\n1,0\n",
     {},
     "recording 'FILE', line 3: the row does not have the header's number of cells (got 2); accepted: 3 cells"},
    {"EmptyCell",
     "time_s,force_N,depth_mm\n0,,0\n",
     {},
     "recording 'FILE', line 2, column 'force_N': the cell is empty (got ''); accepted: finite numbers such as 0.015 or 1.5e-3; remove the row, or fill the gap before replaying"},
    {"QuotedCell",
     "time_s,force_N,depth_mm\n\"0\",0,0\n",
     {},
     "recording 'FILE', line 2, column 'time_s': quoted fields are not read (got '\"0\"'); accepted: finite numbers such as 0.015 or 1.5e-3; write the numbers without quotes"},
    {"Nan",
     "time_s,force_N,depth_mm\n0,0,0\n1,NaN,0\n",
     {},
     "recording 'FILE', line 3, column 'force_N': the cell is not a finite number (got 'NaN'); accepted: finite numbers such as 0.015 or 1.5e-3; remove the row; a gap in time is allowed and shown as one"},
    {"Overflow",
     "time_s,force_N,depth_mm\n0,0,-1e999\n",
     {},
     "recording 'FILE', line 2, column 'depth_mm': the cell is not a finite number (got '-1e999'); accepted: finite numbers such as 0.015 or 1.5e-3; remove the row; a gap in time is allowed and shown as one"},
    {"TimeStandsStill",
     "time_s,force_N,depth_mm\n0,0,0\n0.1,0,0\n0.1,0,0\n",
     {},
     "recording 'FILE', line 4: time does not increase (got 0.1 s after 0.1 s); accepted: each row later than the one before; sort the rows and remove repeated ones"},
    {"TimeRunsBack",
     "time_s,force_N,depth_mm\n5,0,0\n4,0,0\n",
     {},
     "recording 'FILE', line 3: time does not increase (got 4 s after 5 s); accepted: each row later than the one before; sort the rows and remove repeated ones"},
    {"TooLong",
     "time_s,force_N,depth_mm\n0,0,0\n1e12,0,0\n",
     {},
     "recording 'FILE', line 3: the recording is too long (got 1e+12 s); accepted: up to 2678400 s; check the unit of the time"},
    {"ScaledOutOfRange",
     "time_s,force_N,depth_mm\n0,1e308,0\n1,0,0\n",
     {.time = {}, .force = {.column = "force_N", .unit = "", .scale = 1e9}, .position = {}},
     "recording 'FILE', line 2: the scaled force or position is not finite; check the units and scales of the mapping"},
    {"Binary",
     std::string_view("time_s,force_N,depth_mm\n\0\x01,0,0\n", 31),
     {},
     "recording 'FILE', line 2, column 'time_s': the cell is not a number (got '?\?'); accepted: finite numbers such as 0.015 or 1.5e-3"},
};
// clang-format on

INSTANTIATE_TEST_SUITE_P(All, ReplayBadFile, ::testing::ValuesIn(kBadFiles),
                         [](const auto& file) { return file.param.name; });

TEST(ReplayBadPath, MissingFileIsNamed) {
  const auto rig = ReplayRig::open({.path = "/no/such/recording.csv"});
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().text(),
            "recording '/no/such/recording.csv': there is no such file; check the path; a relative path "
            "starts at the "
            "folder in which the daemon was started");
}

TEST(ReplayBadPath, FolderIsNotARecording) {
  const auto rig = ReplayRig::open({.path = "/"});
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().text(), "recording '/': this is not a regular file; give a CSV file");
}

TEST(ReplayBadPath, LineWithoutEndIsRefusedInBoundedMemory) {
  std::string content = "time_s,force_N,depth_mm\n";
  content.append(2 * CsvFile::kMaxLineBytes, '1');
  EXPECT_EQ(refusal(content),
            "recording 'FILE', line 2: the line is too long for a table of numbers; accepted: lines up to "
            "65536 bytes; "
            "check that this is a CSV file");
}

TEST(ReplayBadPath, RateAndBiasHaveARange) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n1,0,0\n");
  const auto fast = ReplayRig::open({.path = file.path(), .rate_hz = 1e6});
  ASSERT_FALSE(fast);
  EXPECT_EQ(fast.error().what, "the rate to resample to is out of range");
  const auto biased = ReplayRig::open({.path = file.path(), .bias_s = 2.0});
  ASSERT_FALSE(biased);
  EXPECT_EQ(biased.error().limit, "0 … 1 s");
  EXPECT_FALSE(ReplayRig::open({.path = file.path(), .bias_s = -1.0}));
}

}  // namespace
}  // namespace hapticd::replay
