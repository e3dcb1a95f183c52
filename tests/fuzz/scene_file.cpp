// Scene files.

#include "server/scene/scene_file.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::server;
  const auto scene = parse_scene({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!scene) return scene.error().what.empty() ? (std::abort(), 0) : 0;
  const std::string written = write_scene(*scene);
  const auto again = parse_scene(written, "written");
  if (!again || write_scene(*again) != written) std::abort();
  return 0;
}
