// What a recording file must look like, and how one that does not is refused.

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
      {"time_s;force_N;depth_mm\n0;0;0\n", {}, ", line 1", kMalformed},
      {"\"time_s\",\"force_N\"\n", {}, ", line 1", kMalformed},
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
       {.time = {}, .force = {.column = "force_N", .unit = "lbf"}, .position = {}},
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
      {"time_s,force_N,depth_mm\n\"0\",0,0\n", {}, ", line 2, column 'time_s'", kMalformed},
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
      "numbers such as 0.015 or 1.5e-3");
  // Bytes that cannot be printed are replaced.
  EXPECT_NE(refusal(std::string_view("time_s,force_N,depth_mm\n\0\x01,0,0\n", 31)).find("(got '?\?')"),
            std::string::npos);
}

TEST(ReplayBadPath, MissingFileIsNamed) {
  const auto rig = ReplayRig::open({.path = "/no/such/recording.csv"});
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().where, "recording '/no/such/recording.csv'");
  EXPECT_EQ(rig.error().code, hal::ErrorCode::kNotFound);
}

TEST(ReplayBadPath, FolderIsNotARecording) {
  const auto rig = ReplayRig::open({.path = "/"});
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().where, "recording '/'");
  EXPECT_EQ(rig.error().code, hal::ErrorCode::kUnreadable);
}

TEST(ReplayBadPath, LineWithoutEndIsRefusedInBoundedMemory) {
  std::string content = "time_s,force_N,depth_mm\n";
  content.append(2 * CsvFile::kMaxLineBytes, '1');
  const auto recording = load(content);
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, hal::ErrorCode::kTooLong);
}

TEST(ReplayBadPath, RateAndBiasHaveARange) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n1,0,0\n");
  const auto fast = ReplayRig::open({.path = file.path(), .rate_hz = 1e6});
  ASSERT_FALSE(fast);
  EXPECT_EQ(fast.error().code, hal::ErrorCode::kOutOfRange);
  const auto biased = ReplayRig::open({.path = file.path(), .bias_s = 2.0});
  ASSERT_FALSE(biased);
  EXPECT_EQ(biased.error().limit, "0 … 1 s");
  EXPECT_FALSE(ReplayRig::open({.path = file.path(), .bias_s = -1.0}));
}

}  // namespace
}  // namespace hapticd::replay
