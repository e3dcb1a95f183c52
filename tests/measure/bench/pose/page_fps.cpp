#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/pose/pose_figures.h"
#include "tests/measure/report/child_process.h"

namespace hapticd::bench {

void add_page_fps(const std::filesystem::path& logs, bool quick, const AddFigure& add) {
  const auto result = logs / "page_fps.json";
  std::filesystem::remove(result);
  const report::ProgramRun run = report::run_program(
      {{"/usr/bin/python3", SOURCE_FOLDER "/tests/measure/bench/pose/page_fps.py", "--hapticd",
        (program_folder() / "hapticd").string(), "--hapticctl", (program_folder() / "hapticctl").string(),
        "--seconds", quick ? "5" : "20", "--out", result.string()}},
      std::chrono::seconds(180));
  std::ifstream file(result);
  const nlohmann::json pages = nlohmann::json::parse(file, nullptr, false);
  if (!pages.is_array()) {
    report::Figure figure{"page_fps", {{"page", "visual"}}};
    figure.goal = 55.0;
    figure.unit = "1/s";
    figure.failed = run.installed ? run.output.substr(run.output.size() > 200 ? run.output.size() - 200 : 0)
                                  : "python3 is not installed";
    add(figure);
    return;
  }
  for (const nlohmann::json& page : pages) {
    for (const auto& [name, key, goal] :
         {std::tuple{"page_fps", "fps", 55.0}, std::tuple{"page_work_ms", "work_ms", 4.0}}) {
      report::Figure figure{
          name,
          {{"page", page["page"].get<std::string>()}, {"drawn_by", page["drawn_by"].get<std::string>()}}};
      figure.unit = std::string(name) == "page_fps" ? "1/s" : "ms";
      figure.goal = goal;
      figure.value = page[key].get<double>();
      add(figure);
    }
  }
}

}  // namespace hapticd::bench
