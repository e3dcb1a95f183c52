// The page that is made of a folder, sweeps in shards, and who is on the Pareto front.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "tests/measure/report/cells.h"
#include "tests/measure/report/html_page.h"
#include "tests/measure/report/report.h"
#include "tests/measure/report/work_precision.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::report {
namespace {

using test::file_text;

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

MarkdownTable small_table(const std::string& cell) {
  MarkdownTable table({"what", "value"});
  table.add_row({cell, "1.5"});
  return table;
}

Plot small_plot(const std::string& title) {
  Plot plot;
  plot.title = title;
  plot.x = {"time", "s"};
  plot.y = {"force", "N"};
  plot.series = {{.name = "one", .points = {{0.0, 1.0}, {1.0, 2.0}}}};
  return plot;
}

TEST(Page, HasAllSectionsInTheirOrderAndNeedsNoOtherFile) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  Report report(folder);
  report.begin_section("second", "The second");
  report.add_table("t2", "Table two", small_table("a<b & c|d"), "how it was measured");
  report.begin_section("first", "The first");
  report.say("What is seen.");
  report.add_plot("p1", small_plot("Plot one"));
  report.add({.figure = "some_error", .conditions = {{"stage", "x<y"}}, .value = 0.25, .run_time_ns = 12.0});
  report.begin_section("unnamed", "Another");
  write_page(folder, {.title = "All of it", .introduction = "Seeds.", .order = {"first", "second"}});

  const std::string html = file_text(folder / "report.html");
  EXPECT_LT(html.find("<h2>The first</h2>"), html.find("<h2>The second</h2>"));
  EXPECT_LT(html.find("<h2>The second</h2>"), html.find("<h2>Another</h2>"));
  EXPECT_NE(html.find("What is seen."), std::string::npos);
  EXPECT_NE(html.find("a&lt;b &amp; c|d"), std::string::npos) << "escaped for HTML, no longer for Markdown";
  EXPECT_NE(html.find("how it was measured"), std::string::npos);
  EXPECT_NE(html.find("x&lt;y"), std::string::npos);
  EXPECT_EQ(count_of(html, "src=\""), count_of(html, "src=\"data:image/svg+xml")) << "nothing is fetched";
  EXPECT_EQ(html.find("http://"), html.find("http://www.w3.org")) << "nothing is fetched";

  const auto json = nlohmann::json::parse(file_text(folder / "report.json"));
  EXPECT_EQ(json["sections"].size(), 3U);
  EXPECT_EQ(json["figures"][0]["run_time_ns"], 12.0);
  EXPECT_TRUE(json["provenance"].contains("commit"));
  const std::string first = html;
  write_page(folder, {.title = "All of it", .introduction = "Seeds.", .order = {"first", "second"}});
  EXPECT_EQ(file_text(folder / "report.html"), first) << "the same folder, the same bytes";
}

TEST(Page, TakesOverWhatAnotherProgramLeft) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  {
    Report other(folder / "other");
    other.begin_section("its", "Its section");
    other.add_table("its_table", "Its table", small_table("x"));
    other.add({.figure = "its_figure", .value = 2.0});
  }
  Report report(folder);
  report.begin_section("mine", "Mine");
  report.add({.figure = "my_figure", .value = 1.0});
  report.take_over(folder / "other");
  report.add({.figure = "my_second_figure", .value = 3.0});
  EXPECT_EQ(count_of(file_text(folder / "figures.jsonl"), "\n"), 3U);
  EXPECT_NE(file_text(folder / "figures.jsonl").find("its_figure"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "its_table.md"));
  const std::string section = file_text(folder / "sections" / "mine.jsonl");
  EXPECT_NE(section.find("Its table"), std::string::npos);
  EXPECT_EQ(section.find("Its section"), std::string::npos) << "part of the present section";
}

CellValues square(std::size_t cell) {
  const auto x = static_cast<double>(cell) / 3.0;
  return {x, x * x, cell == 4 ? std::numeric_limits<double>::quiet_NaN() : -x};
}

TEST(Cells, InShardsMergedAreTheWholeByteByByte) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  const auto whole = Cells(folder / "whole", "r1").values("squares", 11, square);
  ASSERT_TRUE(whole);
  EXPECT_FALSE(Cells(folder / "a", "r1", Shard{1, 2}).values("squares", 11, square));
  EXPECT_FALSE(Cells(folder / "b", "r1", Shard{2, 2}).values("squares", 11, square));
  const Cells merging(folder / "merged", "r1", {folder / "b", folder / "a"});
  const auto merged = merging.values(
      "squares", 11, [](std::size_t) -> CellValues { throw std::logic_error("merging computes nothing"); });
  ASSERT_TRUE(merged);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ((*merged)[i][1], (*whole)[i][1]);
    EXPECT_EQ(std::isnan((*merged)[i][2]), std::isnan((*whole)[i][2]));
  }
  EXPECT_EQ(file_text(folder / "merged/cells/squares.jsonl"),
            file_text(folder / "whole/cells/squares.jsonl"));
}

TEST(Cells, OfOtherRevisionsOrMissingOnesAreRefusedByName) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  Cells(folder / "a", "r1", Shard{1, 2}).values("squares", 11, square);
  Cells(folder / "old", "r0", Shard{2, 2}).values("squares", 11, square);
  Cells(folder / "short", "r1", Shard{2, 2}).values("squares", 9, square);
  const auto complaint = [&](const char* other) {
    try {
      Cells(folder / "m", "r1", {folder / "a", folder / other}).values("squares", 11, square);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(complaint("a").find("5 of 11 cells are in no shard"), std::string::npos) << complaint("a");
  EXPECT_NE(complaint("old").find("revision 'r0'"), std::string::npos) << complaint("old");
  EXPECT_NE(complaint("short").find("9 cells, not 11"), std::string::npos) << complaint("short");
  EXPECT_NE(complaint("nowhere").find("nowhere"), std::string::npos) << complaint("nowhere");
}

TEST(Cells, AnErrorInOneEndsTheSweepAndIsReported) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  const Cells cells(folder, "r1");
  EXPECT_THROW(cells.values("bad", 20,
                            [](std::size_t cell) -> CellValues {
                              if (cell == 7) throw std::runtime_error("cell seven");
                              return {1.0};
                            }),
               std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder / "cells/bad.jsonl")) << "a broken sweep is not kept";
}

TEST(Shard, IsReadOrRefused) {
  EXPECT_EQ(Shard::from("2/8").index, 2U);
  EXPECT_EQ(Shard::from("2/8").count, 8U);
  for (const char* wrong : {"0/2", "3/2", "1", "a/b", "1/2/3", "-1/2", "", "/"}) {
    EXPECT_THROW(Shard::from(wrong), std::invalid_argument) << wrong;
  }
}

WorkPrecision three(const char* chosen) {
  WorkPrecision stage{.stage = "velocity", .error_name = "error"};
  stage.methods = {{"fast", 0.5, 10.0}, {"exact", 0.1, 100.0}, {"poor", 0.6, 90.0}};
  for (Method& method : stage.methods) method.is_default = method.name == chosen;
  return stage;
}

TEST(WorkPrecision, TheFrontIsWhoIsBeatenByNoOne) {
  const WorkPrecision stage = three("fast");
  EXPECT_TRUE(is_on_front(stage, stage.methods[0]));
  EXPECT_TRUE(is_on_front(stage, stage.methods[1]));
  EXPECT_FALSE(is_on_front(stage, stage.methods[2]));
}

TEST(WorkPrecision, WhatTimingsCannotTellDecidesNothing) {
  WorkPrecision stage{.stage = "s", .error_name = "e"};
  stage.methods = {{"a", 0.100, 100.0}, {"b", 0.100, 95.0}, {"c", 0.101, 99.0}};
  for (const Method& method : stage.methods) EXPECT_TRUE(is_on_front(stage, method)) << method.name;
}

TEST(WorkPrecision, ABeatenDefaultNeedsAReason) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  Report report(folder);
  EXPECT_THROW(add_work_precision(report, three("no one")), std::logic_error);
  Report second(folder / "second");
  EXPECT_THROW(add_work_precision(second, three("poor")), std::logic_error);
  Report third(folder / "third");
  WorkPrecision justified = three("poor");
  justified.justification = "it needs no model.";
  EXPECT_NO_THROW(add_work_precision(third, justified));
  const auto figures = file_text(folder / "third/figures.jsonl");
  EXPECT_EQ(count_of(figures, "error_vs_runtime"), 3U);
  EXPECT_EQ(count_of(figures, kDefaultMethod), 1U);
}

}  // namespace
}  // namespace hapticd::report
