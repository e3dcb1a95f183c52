// A register map as a person writes it: whatever the text is, it is a map that reads back as the same, or an
// error that says what is wrong.
#include "server/rig_file/turntable_map.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "hal/modbus/register_map.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto map = server::parse_turntable_map(text, "fuzz", "fuzz");
  if (!map) {
    if (map.error().what.empty()) std::abort();
    return 0;
  }
  (void)modbus::interpret(*map, {}, modbus::read_plan(*map), {});
  const auto again = server::parse_turntable_map(server::write_turntable_map(*map, ""), "fuzz", "fuzz");
  if (!again || !(*again == *map)) std::abort();
  return 0;
}
