// Recordings.

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "hal/replay/recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::replay;
  const int file = memfd_create("recording", MFD_CLOEXEC);
  if (file < 0 || write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  const auto recording = load_recording("/proc/self/fd/" + std::to_string(file), {});
  close(file);
  if (!recording) return recording.error().what.empty() ? (std::abort(), 0) : 0;
  for (std::size_t i = 0; i < recording->time_s.size(); ++i) {
    if (!std::isfinite(recording->force_n[i]) || !std::isfinite(recording->depth_mm[i])) std::abort();
    if (i > 0 && !(recording->time_s[i] > recording->time_s[i - 1])) std::abort();
  }
  return 0;
}
