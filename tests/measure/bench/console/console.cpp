#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {

namespace {

using nlohmann::json;

report::Figure to_figure(const json& line) {
  report::Figure figure{.figure = line.at("figure").get<std::string>(),
                        .unit = line.at("unit").get<std::string>(),
                        .source = line.at("source").get<std::string>(),
                        .failed = line.at("failed").get<std::string>()};
  for (const auto& [name, value] : line.at("case").items()) {
    if (value.is_string()) {
      figure.conditions.push_back({name, value.get<std::string>()});
    } else {
      figure.conditions.push_back({name, value.get<double>()});
    }
  }
  if (!line.at("value").is_null()) figure.value = line.at("value").get<double>();
  if (!line.at("goal").is_null()) figure.goal = line.at("goal").get<double>();
  return figure;
}

std::string case_text(const json& conditions) {
  std::string text;
  for (const auto& [name, value] : conditions.items())
    text += (text.empty() ? "" : ", ") + name + " " + value.dump();
  return text;
}

}  // namespace

// The browser is driven by a script: Debian's library for it is one of Python.
int run_console(const ConsoleOptions& options) {
  report::Report report(options.folder);
  const std::filesystem::path lines = std::filesystem::absolute(report.folder() / "console.jsonl");
  std::vector<std::string> command{"/usr/bin/python3",
                                   SOURCE_FOLDER "/tests/measure/bench/console/console_bench.py",
                                   "--binaries",
                                   program_folder().string(),
                                   "--out",
                                   lines.string(),
                                   "--heap-s",
                                   std::to_string(options.heap_seconds)};
  if (options.quick) command.emplace_back("--quick");
  const auto ran = report::run_program({.command = command},
                                       std::chrono::seconds(900 + static_cast<long>(options.heap_seconds)));
  if (ran.status != 0) {
    report::Report::note(ran.output);
    return 1;
  }
  report::MarkdownTable table{{"figure", "case", "value", "unit", "goal", "failed"}};
  std::ifstream file(lines);
  for (std::string text; std::getline(file, text);) {
    const json line = json::parse(text);
    const report::Figure figure = to_figure(line);
    report.add(figure);
    table.add_row({figure.figure, case_text(line.at("case")),
                   figure.value ? report::fixed(*figure.value, 3) : report::kNoNumber, figure.unit,
                   figure.goal ? report::fixed(*figure.goal, 2) : "", figure.failed});
  }
  report.add_table("console", "The console", table,
                   "In headless Chromium on this machine, against the daemon on the simulated rig at 1 kHz.");
  return 0;
}

}  // namespace hapticd::bench
