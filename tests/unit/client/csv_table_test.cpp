#include "client/cli/csv_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "client/cli/session.h"

namespace hapticd::cli {
namespace {

std::string file_with(const std::string& text) {
  const std::string path = testing::TempDir() + "csv_table_test.csv";
  std::ofstream(path) << text;
  return path;
}

TEST(CsvTable, ReadsNumbersAndPassesOverComments) {
  const auto table =
      CsvTable::read(file_with("# a comment\ntime_s,reason,force_n\n0.5,free,-1.5e-3\r\n# more\n1,held,\n"));
  EXPECT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.column("time_s"), (std::vector<double>{0.5, 1.0}));
  EXPECT_DOUBLE_EQ(table.column("force_n")[0], -1.5e-3);
  EXPECT_TRUE(std::isnan(table.column("force_n")[1]));
  EXPECT_TRUE(std::isnan(table.column("reason")[0]));
}

TEST(CsvTable, NamesTheLineThatIsWrong) {
  try {
    CsvTable::read(file_with("# c\na,b\n1,2\n1,2,3\n"));
    ADD_FAILURE();
  } catch (const LocalError& error) {
    EXPECT_NE(error.detail().where().find("line 4"), std::string::npos);
    EXPECT_EQ(error.detail().value(), "3 cells");
    EXPECT_EQ(error.detail().limit(), "2 cells");
  }
}

TEST(CsvTable, RefusesWhatIsNoRecording) {
  EXPECT_THROW(CsvTable::read("/nonexistent.csv"), LocalError);
  EXPECT_THROW(CsvTable::read(testing::TempDir()), LocalError);
  EXPECT_THROW(CsvTable::read(file_with("")), LocalError);
  EXPECT_THROW(CsvTable::read(file_with("a,b\n")), LocalError);
  const auto table = CsvTable::read(file_with("a,b\n1,2\n"));
  EXPECT_FALSE(table.has("c"));
  EXPECT_THROW(table.column("c"), LocalError);
}

}  // namespace
}  // namespace hapticd::cli
