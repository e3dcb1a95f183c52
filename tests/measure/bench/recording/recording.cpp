#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/recording/parts.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {

int run_recording(const RecordingOptions& options) {
  report::Report report(options.folder);
  const std::filesystem::path logs = std::filesystem::absolute(report.folder() / "recording");
  std::filesystem::remove_all(logs);
  std::filesystem::create_directories(logs);
  report::MarkdownTable table{{"figure", "value", "unit", "goal", "failed"}};
  const auto add = [&](const std::string& name, const report::Figure& figure) {
    report.add(figure);
    table.add_row({name, figure.value ? report::fixed(*figure.value, 3) : report::kNoNumber, figure.unit,
                   figure.goal ? report::fixed(*figure.goal, 2) : "", figure.failed});
  };
  const auto wanted = [&](const char* part) {
    const bool is_wanted = options.only.empty() ||
                           std::find(options.only.begin(), options.only.end(), part) != options.only.end();
    if (is_wanted) report::Report::note(std::string(part) + " …");
    return is_wanted;
  };
  if (wanted("cost")) add_cost_figures(logs, options.quick, add);
  if (wanted("service")) add_service_figures(logs, options.quick, add);
  if (wanted("install")) add_install_figure(logs, options.packages, add);
  report.add_table("recording", "What recording costs", table);
  return 0;
}

}  // namespace hapticd::bench
