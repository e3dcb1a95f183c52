#include "client/cli/plot/csv_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "client/cli/calibrate/pose_files.h"
#include "client/cli/session/session.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

CsvTable table_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return CsvTable::read(folder.write("table.csv", text));
}

TEST(CsvTable, ReadsNumbersAndSkipsComments) {
  const auto table = table_of("# a comment\ntime_s,reason,force_n\n0.5,free,-1.5e-3\r\n# more\n1,held,\n");
  EXPECT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.column("time_s"), (std::vector<double>{0.5, 1.0}));
  EXPECT_DOUBLE_EQ(table.column("force_n")[0], -1.5e-3);
  EXPECT_TRUE(std::isnan(table.column("force_n")[1]));
  EXPECT_TRUE(std::isnan(table.column("reason")[0]));
}

TEST(CsvTable, NamesTheLineThatIsWrong) {
  const LocalError error = test::thrown_by<LocalError>([&] { table_of("# c\na,b\n1,2\n1,2,3\n"); });
  EXPECT_NE(error.detail().where().find("line 4"), std::string::npos);
  EXPECT_EQ(error.detail().value(), "3 cells");
  EXPECT_EQ(error.detail().limit(), "2 cells");
}

TEST(ReferenceFile, NamesTheColumnsOfATrackerThatAreMissing) {
  const test::TemporaryFolder folder;
  for (const auto& [text, missing] :
       {std::pair{"time_s,x_mm,y_mm,z_mm\n0,1,2,3\n", "'stamp_ns'"},
        std::pair{"stamp_s,x_mm,y_mm,z\n0,1,2,3\n", "'z_mm'"},
        std::pair{"stamp_ns,x_mm,y_mm,z_mm,qw,qx,qy\n0,1,2,3,1,0,0\n", "'qz'"}}) {
    const LocalError error =
        test::thrown_by<LocalError>([&] { (void)read_reference_file(folder.write("tracker.csv", text)); });
    EXPECT_NE(error.detail().remedy().find(missing), std::string::npos) << error.detail().remedy();
    EXPECT_NE(error.detail().limit().find("stamp_ns"), std::string::npos);
  }
  EXPECT_EQ(
      read_reference_file(folder.write("t.csv", "stamp_ns,x_mm,y_mm,z_mm\n5,1,2,3\n")).front().poses_size(),
      1);
}

TEST(CsvTable, RefusesAFileThatIsNotARecording) {
  EXPECT_THROW(CsvTable::read("/nonexistent.csv"), LocalError);
  EXPECT_THROW(CsvTable::read(test::TemporaryFolder().path()), LocalError);
  EXPECT_THROW(table_of(""), LocalError);
  EXPECT_THROW(table_of("a,b\n"), LocalError);
  const auto table = table_of("a,b\n1,2\n");
  EXPECT_FALSE(table.has("c"));
  EXPECT_THROW(table.column("c"), LocalError);
}

}  // namespace
}  // namespace hapticd::cli
