// What peers of the OpenIGTLink bridge send.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "client/igtl/igtl_messages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using hapticd::igtl_bridge::MessageReader;
  MessageReader reader;
  // In pieces, as a socket gives them.
  for (std::size_t at = 0; at < size;) {
    const std::size_t piece = std::min<std::size_t>(size - at, 1 + data[at]);
    reader.add(data + at, piece);
    at += piece;
    for (;;) {
      const MessageReader::Event event = reader.next();
      if (event == MessageReader::Event::kNothing) break;
      if (event == MessageReader::Event::kUnreadable) return reader.problem().empty() ? (std::abort(), 0) : 0;
      if (event == MessageReader::Event::kBroken && reader.problem().empty()) std::abort();
    }
  }
  return 0;
}
