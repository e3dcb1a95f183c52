#include <algorithm>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/pose/pose_figures.h"
#include "tests/measure/report/markdown_table.h"

namespace hapticd::bench {

std::vector<std::string> pose_parts() {
  return {"age", "cpu", "contact", "page"};
}

int run_pose(const PoseOptions& options) {
  report::Report report(options.folder);
  report.begin_section("pose", "Poses for those who draw");
  report::MarkdownTable table({"figure", "case", "value", "unit", "goal"});
  const AddFigure add = [&](const report::Figure& figure) {
    report.add(figure);
    std::string conditions;
    for (const auto& [name, value] : figure.conditions) {
      const auto* text = std::get_if<std::string>(&value.content());
      conditions += (conditions.empty() ? "" : ", ") + name + " " +
                    (text != nullptr ? *text : report::significant(std::get<double>(value.content()), 4));
    }
    table.add_row({figure.figure, conditions,
                   figure.value ? report::significant(*figure.value, 3) : figure.failed, figure.unit,
                   figure.goal ? report::significant(*figure.goal, 3) : ""});
  };
  const auto wanted = [&](const std::string& part) {
    return options.only.empty() ||
           std::find(options.only.begin(), options.only.end(), part) != options.only.end();
  };
  const std::filesystem::path logs = report.folder();
  if (wanted("age")) add_pose_ages(logs, options.quick, add);
  if (wanted("cpu")) add_pose_cpu(logs, options.quick, add);
  if (wanted("contact")) add_contact_events(logs, options.quick, add);
  if (wanted("page")) add_page_fps(logs, options.quick, add);
  report.add_table("pose", "Poses for those who draw", table);
  return 0;
}

int run_pose_child(const std::string& address, double seconds) {
  read_poses(address, 120.0, seconds, 16);
  return 0;
}

}  // namespace hapticd::bench
