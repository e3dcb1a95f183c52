#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/measure/report/child_process.h"
#include "tests/measure/study/common/parts.h"

namespace hapticd::study {

namespace {

constexpr std::chrono::minutes kMax{15};

/// Runs `hapticd_bench NAME` into a separate folder, then takes it over.
void take_from_bench(StudyContext& context, const std::string& name) {
  const auto bench = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "hapticd_bench";
  const auto folder = context.report.folder() / ("bench_" + name);
  std::vector<std::string> command{bench.string(), name, "--out", folder.string()};
  if (context.quick) command.emplace_back("--quick");
  report::Report::note("hapticd_bench " + name + " …");
  const report::ProgramRun run = report::run_program({.command = std::move(command)}, kMax);
  if (!run.installed) throw std::runtime_error("hapticd_bench is not next to this program; build it");
  report::Report::note(run.output);
  if (run.status != 0) {
    throw std::runtime_error("hapticd_bench " + name + " ended with status " + std::to_string(run.status));
  }
  context.report.take_over(folder);
}

}  // namespace

void run_scene_economy(StudyContext& context) {
  take_from_bench(context, "scenes");
}

void run_realtime_cost(StudyContext& context) {
  take_from_bench(context, "realtime");
}

}  // namespace hapticd::study
