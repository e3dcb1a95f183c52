#include "hal/recording/free_disk.h"

#include <sys/statvfs.h>

#include <limits>

namespace hapticd::recording {

double free_disk_mb(const std::string& folder) {
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return std::numeric_limits<double>::infinity();
  return static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / 1e6;
}

}  // namespace hapticd::recording
