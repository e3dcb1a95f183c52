// Identified models as they are exported, imported and stored.

#include "server/model_json.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto model = hapticd::server::parse_canonical_json({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!model && model.error().what.empty()) std::abort();
  return 0;
}
