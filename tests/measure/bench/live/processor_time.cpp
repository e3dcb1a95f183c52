#include "tests/measure/bench/live/processor_time.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace hapticd::bench {

double processor_s(pid_t pid, const std::string& thread) {
  double ticks = 0.0;
  bool found = false;
  const auto add = [&](const std::filesystem::path& folder) {
    std::ifstream file(folder / "stat");
    std::string text((std::istreambuf_iterator<char>(file)), {});
    const auto close = text.rfind(')');
    if (close == std::string::npos) return;
    const auto open = text.find('(');
    if (!thread.empty() && text.substr(open + 1, close - open - 1) != thread) return;
    std::istringstream rest(text.substr(close + 2));
    std::string skipped;
    for (int i = 0; i < 11; ++i) rest >> skipped;
    double user = 0.0, system = 0.0;
    rest >> user >> system;
    ticks += user + system;
    found = true;
  };
  const std::filesystem::path process = "/proc/" + std::to_string(pid);
  if (thread.empty()) {
    add(process);
  } else {
    for (const auto& entry : std::filesystem::directory_iterator(process / "task")) add(entry.path());
  }
  if (!found) throw std::runtime_error("there is no process or thread '" + thread + "'");
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace hapticd::bench
