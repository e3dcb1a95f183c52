// The whole report, quickly: that it runs to its end and lacks nothing. Its readers judge its numbers.
// HAPTICD_REPORT may name the folder of one that has been made already.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/measure/report/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::study {
namespace {

constexpr std::chrono::minutes kTimeout{15};

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// `hapticd_study report --quick` with these further options; fails the test if that ends badly.
void run_report(const std::filesystem::path& folder, const std::vector<std::string>& options) {
  const auto programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  std::vector<std::string> command{(programs / "hapticd_study").string(), "report", "--quick", "--out",
                                   folder.string()};
  command.insert(command.end(), options.begin(), options.end());
  const report::ProgramRun run = report::run_program({.command = command}, kTimeout);
  ASSERT_EQ(run.status, 0) << run.output;
}

TEST(ReportRun, LacksNothing) {
  const test::TemporaryFolder temporary;
  const char* made = std::getenv("HAPTICD_REPORT");
  const std::filesystem::path folder = made != nullptr ? made : temporary.path();
  if (made == nullptr) {
    ASSERT_NO_FATAL_FAILURE(run_report(folder, {}));
  }
  const auto report = nlohmann::json::parse(content(folder / "report.json"));

  std::map<std::string, std::set<std::string>> stages;
  std::map<std::string, int> figures;
  for (const auto& record : report["figures"]) {
    const auto name = record["figure"].get<std::string>();
    ++figures[name];
    if (name == "error_vs_runtime") {
      stages[record["case"]["stage"]].insert(record["case"]["method"].get<std::string>());
      EXPECT_TRUE(record["value"].is_null() || record["run_time_ns"].is_number()) << record;
    }
  }
  for (const char* stage : {"velocity", "acceleration", "contact_detection", "direction", "displacement",
                            "friction", "loop_rate", "integrator"}) {
    EXPECT_GE(stages[stage].size(), 2U) << stage;
  }
  EXPECT_TRUE(std::any_of(stages.begin(), stages.end(),
                          [](const auto& stage) { return stage.first.starts_with("identification"); }));
  for (const char* figure : {"stability_margin", "extreme_error", "trap", "scene_cost_instructions",
                             "scene_cost_ns", "scene_memory_bytes", "command_to_effect_us", "echo_us",
                             "subscribers_without_loss", "wakeup_p999_us"}) {
    EXPECT_GE(figures[figure], 1) << figure;
  }

  int plots = 0;
  for (const auto& section : report["sections"]) {
    int items = 0;
    for (const auto& item : section) {
      if (item["kind"] != "section") ++items;
      if (item["kind"] != "plot") continue;
      ++plots;
      EXPECT_EQ(item["missing"], "") << item["name"];
    }
    EXPECT_GE(items, 1) << section[0];
  }
  const std::string html = content(folder / "report.html");
  for (const auto& section : report["sections"]) {
    EXPECT_NE(html.find("id=\"" + section[0]["name"].get<std::string>() + '"'), std::string::npos);
  }
  EXPECT_GE(plots, 20);
  EXPECT_GE(report["sections"].size(), 14U);
}

/// Everything that follows from the cells alone: all files but the page's provenance.
std::map<std::string, std::string> files_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[std::filesystem::relative(entry.path(), folder).string()] = content(entry.path());
    }
  }
  return files;
}

TEST(ReportRun, InShardsIsTheSameByteByByte) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  const std::vector<std::string> parts{"--only", "maps", "inclusions", "sensitivity", "extremes"};
  const auto with = [&parts](std::vector<std::string> more) {
    more.insert(more.begin(), parts.begin(), parts.end());
    return more;
  };
  ASSERT_NO_FATAL_FAILURE(run_report(folder / "whole", with({})));
  ASSERT_NO_FATAL_FAILURE(run_report(folder / "one", with({"--shard", "1/2"})));
  ASSERT_NO_FATAL_FAILURE(run_report(folder / "two", with({"--shard", "2/2"})));
  ASSERT_NO_FATAL_FAILURE(
      run_report(folder / "merged", with({"--merge", (folder / "two").string(), (folder / "one").string()})));
  const auto whole = files_in(folder / "whole");
  const auto merged = files_in(folder / "merged");
  EXPECT_GT(whole.size(), 10U);
  EXPECT_EQ(whole.size(), merged.size());
  for (const auto& [name, text] : whole) {
    ASSERT_TRUE(merged.contains(name)) << name;
    EXPECT_TRUE(merged.at(name) == text) << name << " differs";
  }
}

}  // namespace
}  // namespace hapticd::study
