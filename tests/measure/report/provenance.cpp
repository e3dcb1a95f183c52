#include "tests/measure/report/provenance.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "hapticd_commit.h"

namespace hapticd::report {
namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string memory() {
  const double bytes =
      static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGE_SIZE));
  return std::to_string(static_cast<long>(bytes / 1e9 + 0.5)) + " GB";
}

std::string kernel() {
  utsname name{};
  if (::uname(&name) != 0) return "unknown";
  return std::string(name.sysname) + ' ' + name.release + ", " + name.machine;
}

}  // namespace

std::string commit() {
  return HAPTICD_COMMIT;
}

std::vector<std::pair<std::string, std::string>> provenance() {
  return {{"commit", commit()},
          {"compiler", HAPTICD_COMPILER},
          {"processor", processor() + ", " + std::to_string(std::thread::hardware_concurrency()) + " used"},
          {"memory", memory()},
          {"kernel", kernel()}};
}

}  // namespace hapticd::report
