#include "tests/measure/study/plant_comparison.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/measure/study/common/plant.h"

namespace hapticd::study {

namespace {

using Json = nlohmann::ordered_json;

struct Values {
  std::vector<double> values;
  int failed = 0;

  std::string text() const {
    if (values.empty()) return failed == 0 ? "" : "none";
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    std::string range = report::significant(*least);
    if (*most != *least) range += " … " + report::significant(*most);
    return range + (failed == 0 ? "" : " (" + std::to_string(failed) + " without)");
  }
  std::string median() const {
    if (values.empty()) return "";
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t half = sorted.size() / 2;
    return report::significant(sorted.size() % 2 == 1 ? sorted[half]
                                                      : 0.5 * (sorted[half - 1] + sorted[half]));
  }
};

struct Row {
  std::string figure, conditions, unit;
  Values separable, general;
};

std::string words_of(const Json& conditions) {
  std::string text;
  for (const auto& [name, value] : conditions.items()) {
    if (!value.is_string() || name == "object" || name == "plant") continue;
    text += (text.empty() ? "" : ", ") + name + ' ' + value.get<std::string>();
  }
  return text;
}

}  // namespace

void compare_plants(report::Report& report, const std::string& section) {
  std::vector<Row> rows;
  std::map<std::string, std::size_t> known;
  std::ifstream file(report.folder() / "figures.jsonl");
  for (std::string line; std::getline(file, line);) {
    const Json record = Json::parse(line, nullptr, false);
    if (!record.is_object() || !record.contains("case")) continue;
    const auto plant = sim::plant_named(record["case"].value("plant", ""));
    if (!plant) continue;
    const std::string figure = record.value("figure", "");
    const std::string conditions = words_of(record["case"]);
    const auto [at, is_new] = known.emplace(figure + '\n' + conditions, rows.size());
    if (is_new) rows.push_back({figure, conditions, record.value("unit", "1"), {}, {}});
    Values& of_plant =
        *plant == sim::Plant::kSeparable ? rows[at->second].separable : rows[at->second].general;
    if (record["value"].is_number()) {
      of_plant.values.push_back(record["value"].get<double>());
    } else {
      ++of_plant.failed;
    }
  }
  report::MarkdownTable table({"figure", "case", "unit", "separable", "its median", "general", "its median"});
  bool has_both = false;
  for (const Row& row : rows) {
    const bool compares = !row.separable.text().empty() && !row.general.text().empty();
    has_both = has_both || compares;
    if (!compares) continue;
    table.add_row({row.figure, row.conditions, row.unit, row.separable.text(), row.separable.median(),
                   row.general.text(), row.general.median()});
  }
  if (!has_both) return;
  const std::string title = "Both families of objects side by side";
  report.begin_section(section, title);
  report.add_table(
      "plants", title, table,
      "Least and largest over objects and whatever else was varied by number; relative errors are "
      "fractions. Separable: objects relax as the creep law's exact inverse. General: power law, "
      "depth- and rate-dependent, hysteresis, Maxwell-slip friction; models are identified again on "
      "it.");
}

}  // namespace hapticd::study
