#include "server/grpc/messages/part_messages.h"

#include "server/text/utf8_text.h"

namespace hapticd::server {

std::string printable(const std::string& text) {
  std::string result = repaired_utf8(text);
  for (char& c : result) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  return result;
}

}  // namespace hapticd::server
