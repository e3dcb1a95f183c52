#include "tests/bench/tick/tick_instructions.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "tests/study/report/child_process.h"

namespace hapticd::bench {
namespace {

constexpr long kTicks = 4000;  // twice through the recorded samples

/// The total of a callgrind file, which stands on its line "summary:" (or "totals:").
std::optional<double> total_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string word;
  double total = 0.0;
  while (file >> word) {
    if ((word == "summary:" || word == "totals:") && file >> total) return total;
  }
  return std::nullopt;
}

struct Run {
  std::optional<double> instructions;
  std::string failed;
};

Run run_under_callgrind(const std::string& scene, long ticks) {
  const std::string name = "hapticd_callgrind_" + scene + "_" + std::to_string(ticks) + ".out";
  const auto file = std::filesystem::temp_directory_path() / name;
  // Without environment: its size moves the stack and with it a few instructions.
  const report::ProgramRun child = report::run_program(
      {.command = {"valgrind", "--tool=callgrind", "--callgrind-out-file=" + file.string(),
                   std::filesystem::read_symlink("/proc/self/exe").string(), "tick-child", "--scene", scene,
                   "--ticks", std::to_string(ticks)},
       .clear_environment = true},
      std::chrono::seconds(300));
  Run run;
  if (!child.installed) {
    run.failed = "valgrind is not installed; apt-get install valgrind";
  } else if (child.status != 0) {
    run.failed = "valgrind ended with status " + std::to_string(child.status) + ": " +
                 child.output.substr(child.output.size() > 400 ? child.output.size() - 400 : 0);
  } else if (run.instructions = total_of(file); !run.instructions) {
    run.failed = "callgrind left no total";
  }
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  return run;
}

}  // namespace

InstructionCount count_instructions(const std::string& scene) {
  const Run once = run_under_callgrind(scene, kTicks);
  if (!once.instructions) return {std::nullopt, once.failed};
  const Run twice = run_under_callgrind(scene, 2 * kTicks);
  if (!twice.instructions) return {std::nullopt, twice.failed};
  return {(*twice.instructions - *once.instructions) / kTicks, ""};
}

}  // namespace hapticd::bench
