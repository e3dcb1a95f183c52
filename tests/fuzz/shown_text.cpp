// What of a text reaches a terminal or a log, whatever its author.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "proto/text/json_depth.h"
#include "proto/text/utf8_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::text;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string shown = printable(text);
  if (!is_utf8(shown) || printable(shown) != shown) std::abort();
  const std::string lines = printable_lines(text);
  if (!is_utf8(lines) || printable_lines(lines) != lines) std::abort();
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const auto byte = static_cast<std::uint8_t>(shown[i]);
    if (byte < 0x20 || byte == 0x7f) std::abort();
    // C1 as UTF-8.
    if (byte == 0xc2 && i + 1 < shown.size() && static_cast<std::uint8_t>(shown[i + 1]) < 0xa0) std::abort();
  }
  if (is_utf8(text) && repaired_utf8(text) != text) std::abort();
  if (!is_utf8(shortened(repaired_utf8(text), 16))) std::abort();
  static_cast<void>(is_shallow_json(text));
  return 0;
}
