// Configuration files of the daemon, the rig's parts included.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "server/config/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::server;
  const auto config = parse_config({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!config) return config.error().what.empty() ? (std::abort(), 0) : 0;
  // What is accepted reads back as the same.
  const std::string written = write_config(*config);
  const auto again = parse_config(written, "written");
  if (!again || write_config(*again) != written) std::abort();
  return 0;
}
