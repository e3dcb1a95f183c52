// The ring that a flight recorder left behind, after a crash or by someone else.

#include "server/recording/flight/flight_ring.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd;
  static const test::TemporaryFolder folder;
  const std::string path = folder.write("flight.ring", {reinterpret_cast<const char*>(data), size});
  const auto ring = server::FlightRing::open_left(path);
  if (!ring) return ring.error().what.empty() ? (std::abort(), 0) : 0;
  std::string rows;
  static_cast<void>((*ring)->notes());
  static_cast<void>((*ring)->anchor());
  static_cast<void>((*ring)->read(0, 16, rows));
  return 0;
}
