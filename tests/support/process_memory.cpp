#include "tests/support/process_memory.h"

#include <fstream>
#include <string>

namespace hapticd::test {

namespace {

double status_mb(pid_t process, const std::string& key) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::stod(line.substr(key.size() + 1)) * 1024.0 / 1e6;
  }
  return 0.0;
}

}  // namespace

double resident_mb(pid_t process) {
  return status_mb(process, "VmRSS");
}

double max_resident_mb(pid_t process) {
  return status_mb(process, "VmHWM");
}

}  // namespace hapticd::test
