#include "tests/measure/bench/tick/tick_instructions.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "tests/measure/report/child_process.h"

namespace hapticd::bench {
namespace {

constexpr long kTicks = 4000;  // twice through the recorded samples, as often before it to warm up

/// The total of a callgrind file, which is on its line "summary:" (or "totals:").
std::optional<double> total_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string word;
  double total = 0.0;
  while (file >> word) {
    if ((word == "summary:" || word == "totals:") && file >> total) return total;
  }
  return std::nullopt;
}

}  // namespace

[[gnu::noinline, gnu::noclone]] void run_counted(TickWorkload& workload, long ticks) noexcept {
  for (long i = 0; i < ticks; ++i) workload.tick();
}

InstructionCount count_instructions(const std::string& scene, Extent extent) {
  const std::string name = "hapticd_callgrind_" + scene + "_" + std::to_string(::getpid()) + ".out";
  const auto file = std::filesystem::temp_directory_path() / name;
  std::vector<std::string> command{"valgrind",
                                   "--tool=callgrind",
                                   "--callgrind-out-file=" + file.string(),
                                   "--toggle-collect=hapticd::bench::run_counted*",
                                   std::filesystem::read_symlink("/proc/self/exe").string(),
                                   "tick-child",
                                   "--scene",
                                   scene,
                                   "--ticks",
                                   std::to_string(kTicks)};
  if (extent == Extent::kEverything) command.emplace_back("--everything");
  // Without environment: its size moves the stack and with it a few instructions.
  const report::ProgramRun child = report::run_program(
      {.command = std::move(command), .clear_environment = true}, std::chrono::seconds(300));
  InstructionCount count;
  if (!child.installed) {
    count.failed = "valgrind is not installed; apt-get install valgrind";
  } else if (child.status != 0) {
    count.failed = "valgrind ended with status " + std::to_string(child.status) + ": " +
                   child.output.substr(child.output.size() > 400 ? child.output.size() - 400 : 0);
  } else if (const auto total = total_of(file); total && *total > 0.0) {
    count.per_tick = *total / kTicks;
  } else {
    count.failed = "callgrind left no total";
  }
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  return count;
}

}  // namespace hapticd::bench
