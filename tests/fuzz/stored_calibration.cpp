// Calibrations as they are kept between two starts.

#include "server/calibration/store/stored_calibration.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::server;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto stored = read_calibration(text);
  if (!stored && stored.error().what.empty()) std::abort();
  return 0;
}
