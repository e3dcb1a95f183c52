// Identified models as they are exported, imported and stored.

#include "server/model/model_json.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/model/canonical_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::server;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto model = parse_canonical_json(text, "fuzz");
  if (!model) {
    if (model.error().what.empty()) std::abort();
  } else {
    // What is accepted is written, and reads back as the same: by itself and carried elsewhere.
    const auto written = canonical_json(*model);
    if (!written) std::abort();
    const auto again = parse_canonical_json(*written, "written");
    if (!again || *canonical_json(*again) != *written) std::abort();
    const auto imported = import_json(export_json(*written, sha256_hex(*written)));
    if (!imported || imported->canonical != *written) std::abort();
  }
  const auto imported = import_json(text);
  if (!imported && imported.error().what.empty()) std::abort();
  if (imported && sha256_hex(imported->canonical) != imported->hash) std::abort();
  return 0;
}
