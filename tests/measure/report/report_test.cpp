// The records, tables and plots of studies and benchmarks.

#include "tests/measure/report/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/measure/report/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::report {
namespace {

using test::file_text;
using test::TemporaryFolder;

TEST(FigureRecord, IsTheOneTheDesignShows) {
  const Figure figure{
      .figure = "displacement_error_median",
      .conditions = {{"object", "sponge_cut"}, {"tip", "rod"}, {"target", 0.3}, {"speed_mm_per_s", 400}},
      .value = 0.043,
      .unit = "1",
      .goal = 0.05,
      .reference = 0.1773,
      .source = "D§4.5.3"};
  EXPECT_EQ(
      to_json_line(figure),
      R"({"figure":"displacement_error_median","case":{"object":"sponge_cut","tip":"rod","target":0.3,)"
      R"("speed_mm_per_s":400},"value":0.043,"unit":"1","goal":0.05,"reference":0.1773,"source":"D§4.5.3"})");
}

TEST(FigureRecord, HasNullsAndNoConditionsWhereThereAreNone) {
  EXPECT_EQ(
      to_json_line({.figure = "contact_false_alarms", .value = 0}),
      R"({"figure":"contact_false_alarms","case":{},"value":0,"unit":"1","goal":null,"reference":null,"source":null})");
}

TEST(FigureRecord, OfAFailedCaseHasNoValueAndAReason) {
  EXPECT_EQ(to_json_line({.figure = "f", .value = 3.0, .unit = "N", .failed = "1 N is not reached"}),
            R"({"figure":"f","case":{},"value":null,"unit":"N","goal":null,"reference":null,"source":null,)"
            R"("failed":"1 N is not reached"})");
  EXPECT_NE(to_json_line({.figure = "f"}).find(R"("value":null)"), std::string::npos);
  EXPECT_NE(to_json_line({.figure = "f"}).find(R"("failed":"no value was measured")"), std::string::npos);
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto record = nlohmann::json::parse(to_json_line({.figure = "f", .value = value, .goal = value}));
    EXPECT_TRUE(record["value"].is_null());
    EXPECT_TRUE(record["goal"].is_null());
    EXPECT_EQ(record["failed"], "the value is not finite");
  }
}

TEST(FigureRecord, NumbersReadBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3.0, 1e-310, -2.5e300, 123456789.0, 9007199254740993.0, -0.125}) {
    const auto record = nlohmann::json::parse(to_json_line({.figure = "f", .value = value}));
    EXPECT_EQ(record["value"].get<double>(), value);
  }
}

TEST(FigureRecord, SurvivesTextThatIsNotUtf8) {
  EXPECT_NO_THROW(nlohmann::json::parse(to_json_line({.figure = "f", .failed = "child said \xff\xfe"})));
}

TEST(FigureWriter, AddsALinePerRecordAtOnce) {
  const TemporaryFolder folder;
  FigureWriter writer(folder.path("deeper"));
  writer.add({.figure = "a", .conditions = {{"file", "x"}}, .value = 1});
  EXPECT_EQ(file_text(writer.path()),
            to_json_line({.figure = "a", .conditions = {{"file", "x"}}, .value = 1}) + "\n");
  writer.add({.figure = "a", .conditions = {{"file", "y"}}, .value = 2});
  EXPECT_THROW(writer.add({.figure = "a", .conditions = {{"file", "y"}}, .value = 3}), std::logic_error)
      << "two values for one case";
}

TEST(FigureWriter, ReplacesOnlyWhatIsMeasuredAgain) {
  const TemporaryFolder folder;
  const auto line = [](const char* figure, double value) {
    return to_json_line({.figure = figure, .value = value}) + "\n";
  };
  {
    FigureWriter tick(folder.path());
    tick.add({.figure = "tick", .value = 1});
    tick.add({.figure = "other", .value = 1});
  }
  std::ofstream(folder.path("figures.jsonl"), std::ios::app) << R"({"figure":"cut sho)";
  FigureWriter again(folder.path());
  EXPECT_EQ(file_text(again.path()), line("tick", 1) + line("other", 1)) << "half a record is none";
  again.add({.figure = "new", .value = 2});
  again.add({.figure = "tick", .value = 3});
  again.add({.figure = "new", .conditions = {{"n", 2}}, .value = 4});
  EXPECT_EQ(file_text(again.path()),
            line("other", 1) + line("new", 2) + line("tick", 3) +
                to_json_line({.figure = "new", .conditions = {{"n", 2}}, .value = 4}) + "\n");
}

TEST(FigureWriter, CommonConditionsEndEachCaseAndKeepTheOthersRecords) {
  const TemporaryFolder folder;
  const auto write = [&folder](const char* plant, double value) {
    FigureWriter writer(folder.path());
    writer.set_common({{"plant", plant}});
    writer.add({.figure = "error", .conditions = {{"object", "sponge"}}, .value = value});
  };
  write("separable", 1.0);
  write("general", 2.0);
  write("separable", 3.0);
  const std::string lines = file_text(folder.path("figures.jsonl"));
  EXPECT_NE(lines.find(R"("case":{"object":"sponge","plant":"general"},"value":2)"), std::string::npos)
      << lines;
  EXPECT_NE(lines.find(R"("case":{"object":"sponge","plant":"separable"},"value":3)"), std::string::npos);
  EXPECT_EQ(lines.find(R"("value":1,)"), std::string::npos) << "replaced";
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 2);
}

TEST(Report, AConditionStandsInNamesAndTitles) {
  const TemporaryFolder folder;
  Report report(folder.path());
  MarkdownTable table({"a"});
  table.add_row({"1"});
  report.begin_section("part", "The part");
  report.add_table("numbers", "Numbers", table);
  report.set_condition("plant", "general", "_general");
  report.begin_section("part", "The part");
  report.add_table("numbers", "Numbers", table);
  report.add({.figure = "f", .value = 1.0});
  EXPECT_NE(file_text(folder.path("numbers.md")).find("## Numbers\n"), std::string::npos);
  EXPECT_NE(file_text(folder.path("numbers_general.md")).find("## Numbers, plant general\n"),
            std::string::npos);
  EXPECT_NE(file_text(folder.path("sections/part_general.jsonl")).find("The part, plant general"),
            std::string::npos);
  EXPECT_NE(file_text(folder.path("figures.jsonl")).find(R"("case":{"plant":"general"})"), std::string::npos);
}

TEST(FigureWriter, SaysWhereItCannotWrite) {
  EXPECT_THROW(FigureWriter("/proc/no/such/folder"), std::runtime_error);
}

TEST(MarkdownTable, PadsAndPutsNumbersToTheRight) {
  MarkdownTable table({"object", "stiffness [N/mm]", "why µ"});
  table.add_row({"sponge|block", "0.38", "a"});
  table.add_row({"wood", "–", "b\nc"});
  EXPECT_EQ(table.text(),
            "| object        | stiffness [N/mm] | why µ |\n"
            "|---------------|-----------------:|-------|\n"
            "| sponge\\|block |             0.38 | a     |\n"
            "| wood          |                – | b c   |\n");
  EXPECT_THROW(table.add_row({"too", "few"}), std::invalid_argument);
}

TEST(MarkdownTable, WritesNumbersForReaders) {
  EXPECT_EQ(fixed(0.1266, 2), "0.13");
  EXPECT_EQ(fixed(std::numeric_limits<double>::quiet_NaN(), 2), "–");
  EXPECT_EQ(significant(0.0123456), "0.0123");
  EXPECT_EQ(significant(9.996), "10.0");
  EXPECT_EQ(significant(1234.0), "1234");
  EXPECT_EQ(significant(-0.5, 2), "-0.50");
  EXPECT_EQ(significant(0.0), "0");
  EXPECT_EQ(significant(1e-9), "1.00e-09");
}

TEST(Plots, LeaveAScriptWithTheirDataBesideTheDrawing) {
  const TemporaryFolder folder;
  Report report(folder.path());
  report.begin_section("s", "S");
  Plot plot{.title = "Force over 'depth'", .x = {.label = "depth", .unit = "mm", .logarithmic = true}};
  plot.series = {{.name = "one", .points = {{0.1, 0.0}, {1.0, 0.5}}}, {.name = "nothing"}};
  report.add_plot("plot", plot);
  const std::string script = file_text(folder.path("plot.gp"));
  EXPECT_NE(script.find("'Force over ''depth'''"), std::string::npos);
  EXPECT_NE(script.find("0.1 0\n1 0.5\n"), std::string::npos);
  EXPECT_NE(file_text(folder.path("plot.svg")).find("</svg>"), std::string::npos);
}

TEST(Plots, WithoutGnuplotKeepTheScriptAndSayWhatToDo) {
  const TemporaryFolder folder;
  Report report(folder.path());
  report.begin_section("s", "S");
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  report.add_plot("plot", {.series = {{.points = {{0.0, 1.0}, {1.0, 2.0}}}}});
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(file_text(folder.path("sections/s.jsonl")).find("apt-get install gnuplot-nox"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder.path("plot.gp")));
}

TEST(ChildProcess, GivesOutputAndStatus) {
  const ProgramRun run =
      run_program({.command = {"sh", "-c", "echo out; echo err >&2; exit 3"}}, std::chrono::seconds(60));
  EXPECT_TRUE(run.installed);
  EXPECT_EQ(run.status, 3);
  EXPECT_EQ(run.output, "out\nerr\n");
  EXPECT_FALSE(run_program({.command = {"no-such-program-here"}}, std::chrono::seconds(60)).installed);
}

TEST(ChildProcess, StartsWithoutEnvironmentWhenAsked) {
  setenv("HAPTICD_REPORT_TEST", "seen", 1);
  const std::vector<std::string> command{"sh", "-c", "echo $HAPTICD_REPORT_TEST"};
  EXPECT_EQ(run_program({.command = command}, std::chrono::seconds(60)).output, "seen\n");
  EXPECT_EQ(run_program({.command = command, .clear_environment = true}, std::chrono::seconds(60)).output,
            "\n");
}

TEST(ChildProcess, IsSignalledAndReaped) {
  ChildProcess child({.command = {"sleep", "600"}});
  EXPECT_FALSE(child.wait(std::chrono::milliseconds(1)));
  child.signal(SIGTERM);
  EXPECT_EQ(child.wait(std::chrono::seconds(60)), 128 + SIGTERM);
}

}  // namespace
}  // namespace hapticd::report
