// The configuration page of a Net F/T box.

#include "hal/netft/netft_configuration.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::netft;
  const auto box = parse_netft_configuration({reinterpret_cast<const char*>(data), size}, "page");
  if (!box) return box.error().what.empty() ? (std::abort(), 0) : 0;
  // What is accepted can be calculated with.
  if (!(box->newtons_per_count > 0.0) || !std::isfinite(box->newtons_per_count)) std::abort();
  if (!(box->newton_millimetres_per_count > 0.0) || !std::isfinite(box->newton_millimetres_per_count)) {
    std::abort();
  }
  for (const auto& six : {box->ranges, box->bias, box->tool_transformation}) {
    if (!six) continue;
    for (const double value : *six) {
      if (!std::isfinite(value)) std::abort();
    }
  }
  return 0;
}
