#include "tests/measure/study/common/page.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/measure/study/common/plant.h"
#include "tests/measure/report/html_page.h"
#include "tests/measure/report/work_precision.h"

namespace hapticd::study {

namespace {

using Json = nlohmann::ordered_json;
using report::significant;

constexpr const char* kSummary = "report_summary";
constexpr std::size_t kNarrowest = 5;
constexpr std::size_t kMax = 3;

std::vector<Json> figures_in(const std::filesystem::path& folder, const std::string& name) {
  std::vector<Json> figures;
  std::ifstream file(folder / "figures.jsonl");
  for (std::string line; std::getline(file, line);) {
    Json record = Json::parse(line, nullptr, false);
    if (record.is_object() && record.value("figure", "") == name && record["value"].is_number()) {
      figures.push_back(std::move(record));
    }
  }
  return figures;
}

std::string case_text(const Json& record) {
  std::string text;
  for (const auto& [name, value] : record.at("case").items()) {
    text += (text.empty() ? "" : ", ") + name + ' ' +
            (value.is_string() ? value.get<std::string>() : significant(value.get<double>()));
  }
  return text;
}

std::string error_text(const Json& record) {
  const double value = record["value"].get<double>();
  const std::string unit = record.value("unit", "1");
  return unit == "1" ? significant(100.0 * value) + " %" : significant(value) + ' ' + unit;
}

/// Each stage's default next to the most exact and the fastest of the others.
void add_defaults(report::Report& report) {
  std::vector<std::string> stages;
  std::map<std::string, std::vector<Json>> of_stage;
  for (const Json& record : figures_in(report.folder(), "error_vs_runtime")) {
    const std::string plant = record["case"].value("plant", "");
    const std::string stage = record["case"].value("stage", "") + (plant.empty() ? "" : ", " + plant);
    if (!of_stage.contains(stage)) stages.push_back(stage);
    of_stage[stage].push_back(record);
  }
  if (stages.empty()) return;
  report::MarkdownTable table(
      {"stage", "default", "its error", "its run time [ns]", "most exact", "its error", "its run time [ns]"});
  for (const std::string& stage : stages) {
    const auto& methods = of_stage[stage];
    const auto chosen = std::find_if(methods.begin(), methods.end(), [](const Json& m) {
      return m["source"].is_string() && m["source"].get<std::string>() == report::kDefaultMethod;
    });
    const auto best = std::min_element(methods.begin(), methods.end(), [](const Json& a, const Json& b) {
      return a["value"].get<double>() < b["value"].get<double>();
    });
    if (chosen == methods.end()) continue;
    const auto cells = [](const Json& m) {
      return std::vector<std::string>{m["case"].value("method", ""), error_text(m),
                                      significant(m["run_time_ns"].get<double>())};
    };
    std::vector<std::string> row{stage};
    for (const Json& method : {*chosen, *best}) {
      for (std::string& cell : cells(method)) row.push_back(std::move(cell));
    }
    table.add_row(row);
  }
  report.add_table(
      "summary_defaults", "What ships, stage by stage", table,
      "Errors are of the simulation's truth, each as its own section says; run times are of this machine.");
}

/// Adds the errors of the defaults whose error is a share of what is measured.
void add_largest_errors(report::Report& report) {
  std::vector<Json> errors;
  for (const Json& record : figures_in(report.folder(), "error_vs_runtime")) {
    const bool is_default = record["source"].is_string() && record["source"] == report::kDefaultMethod;
    if (is_default && record.value("unit", "") == "1") errors.push_back(record);
  }
  if (errors.empty()) return;
  std::stable_sort(errors.begin(), errors.end(), [](const Json& a, const Json& b) {
    return a["value"].get<double>() > b["value"].get<double>();
  });
  report::MarkdownTable table({"error", "where"});
  for (std::size_t i = 0; i < std::min(kMax, errors.size()); ++i)
    table.add_row({error_text(errors[i]), case_text(errors[i])});
  report.add_table("summary_errors", "The largest errors of what ships", table);
}

/// Scenes as they ship; what else was mapped is in its own section.
bool is_shipped(const Json& margin) {
  const std::string options = margin["case"].value("options", "");
  return options == "tap_1d" || options == "explore_bearing";
}

void add_narrowest(report::Report& report) {
  std::vector<Json> margins = figures_in(report.folder(), "stability_margin");
  std::erase_if(margins, [](const Json& margin) { return !is_shipped(margin); });
  if (margins.empty()) return;
  std::stable_sort(margins.begin(), margins.end(), [](const Json& a, const Json& b) {
    return a["value"].get<double>() < b["value"].get<double>();
  });
  report::MarkdownTable table({"margin", "where"});
  for (std::size_t i = 0; i < std::min(kNarrowest, margins.size()); ++i)
    table.add_row({significant(margins[i]["value"].get<double>()), case_text(margins[i])});
  report.add_table(
      "summary_margins", "The narrowest stability margins of what ships", table,
      "Factor from a target to the nearer end of the stable range, under a hand; below 1 the target "
      "itself is unstable.");
}

void add_dearest(report::Report& report) {
  std::vector<Json> costs = figures_in(report.folder(), "scene_cost_instructions");
  if (costs.empty()) return;
  report::MarkdownTable table({"scene", "instructions per tick"});
  for (const Json& cost : costs)
    table.add_row({case_text(cost), significant(cost["value"].get<double>(), 4)});
  report.add_table("summary_scenes", "What a tick costs", table);
}

/// Figures in the order of the walk, then stability, extremes, cost.
std::vector<std::string> order_of(const Study& study) {
  std::vector<std::string> order{kSummary};
  for (const StudyPart& part : study.parts) {
    for (const sim::Plant plant : {sim::Plant::kSeparable, sim::Plant::kGeneral}) {
      order.push_back(std::string(study.name) + '_' + part.name + plant_suffix(plant));
    }
  }
  return order;
}

}  // namespace

void summarize_report(StudyContext& context) {
  context.report.begin_section(kSummary, "Summary");
  add_defaults(context.report);
  add_largest_errors(context.report);
  add_narrowest(context.report);
  add_dearest(context.report);
}

void write_page(const Study& study, const StudyContext& context) {
  const bool has_summary = study.summarize != nullptr;
  report::write_page(
      context.report.folder(),
      {.title = std::string("hapticd: ") + study.shows,
       .readers = "hapticd is a program that changes how stiff a real object feels: a device holds the tool "
                  "with which a person presses the object, and adds or takes force while he presses. This "
                  "page is about one question: " +
                  std::string(study.shows) +
                  ". Each section answers a part of it with a table or a plot. Where an error has no unit it "
                  "is a fraction: 0.05 means wrong by 5 percent. Smaller is better, unless a heading says "
                  "otherwise; a goal was set before it was measured, and a case that failed is shown as "
                  "failed." +
                  (has_summary ? " Begin with the summary." : ""),
       .introduction =
           std::string(context.quick ? "A quick run: fewer and shorter cases, for completeness and not for "
                                       "its numbers. "
                                     : "") +
           "Unless a section says otherwise, time is virtual and all is seeded (sim::SimulationConfig::seed "
           "is 1) and judged against the simulated rig's ground truth: the same on every machine with the "
           "same floating-point library. Run times, instructions and latencies are of this machine.",
       .order = order_of(study)});
}

}  // namespace hapticd::study
