#include <fstream>
#include <stdexcept>

#include "server/scene/scene_inclusions.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/tumour/tumour_trial.h"

namespace hapticd::study {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::hours kTimeout{1};

/// Runs NAME.py with the package and the daemon of this build; what it leaves becomes the report's.
void run_program_of(StudyContext& context, const std::string& name) {
  const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path();
  const fs::path folder = fs::absolute(context.report.folder()) / name;
  report::Launch launch{.command = {"/usr/bin/env", "PYTHONDONTWRITEBYTECODE=1",
                                    "PYTHONPATH=" + (programs.parent_path() / "python").string(),
                                    "HAPTICD_BINARIES=" + programs.string(), "/usr/bin/python3",
                                    std::string(HAPTICD_EXPERIMENTS) + "/" + name + ".py", "--out",
                                    folder.string()}};
  if (context.quick) launch.command.emplace_back("--quick");
  const report::ProgramRun run = report::run_program(launch, kTimeout);
  report::Report::note(run.output);
  if (run.status != 0)
    throw std::runtime_error(name + ".py ended with status " + std::to_string(run.status) + ": " +
                             run.output.substr(run.output.size() > 2000 ? run.output.size() - 2000 : 0));
  context.report.take_over(folder);
}

}  // namespace

void run_estimators(StudyContext& context) {
  run_program_of(context, "estimators");
}
void run_chain(StudyContext& context) {
  // The rendered tumours, as they are identified on the phantoms (D§5.4).
  const fs::path folder = context.report.folder() / "chain";
  fs::create_directories(folder);
  for (const std::string kind : {"hard", "soft"}) {
    const rt::SceneSpec scene =
        inclusion_scene({identified_tumour(("phantom_" + kind).c_str()).by_scan.inclusion});
    std::ofstream(folder / ("tumour_" + kind + ".toml")) << server::inclusions_text(scene);
  }
  run_program_of(context, "chain");
}
void run_resume(StudyContext& context) {
  run_program_of(context, "resume");
}
void run_guided_presses(StudyContext& context) {
  run_program_of(context, "assistance");
}
void run_python_telemetry(StudyContext& context) {
  run_program_of(context, "telemetry_cost");
}

}  // namespace hapticd::study
