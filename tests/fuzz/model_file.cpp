// Files with models of objects.

#include "server/model/model_file.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::server;
  const auto model = parse_model({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!model) return model.error().what.empty() ? (std::abort(), 0) : 0;
  const std::string written = write_model(*model);
  const auto again = parse_model(written, "written");
  if (!again || write_model(*again) != written) std::abort();
  return 0;
}
