#include "client/console/daemon/caller.h"

#include <grpcpp/client_context.h>

#include <algorithm>

#include "client/console/access/metadata_value.h"

namespace hapticd::console {

namespace {

constexpr std::size_t kTokenSize = 32;

bool is_hex_digit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

}  // namespace

bool is_token(std::string_view text) {
  return text.size() == kTokenSize && std::all_of(text.begin(), text.end(), is_hex_digit);
}

bool fill(grpc::ClientContext& context, const Caller& caller) {
  if (is_token(caller.lease)) context.AddMetadata("hapticd-lease", caller.lease);
  if (caller.name.empty()) return true;
  for (const std::string* text : {&caller.name, &caller.serial, &caller.peer}) {
    if (!is_metadata_value(*text)) return false;
  }
  context.AddMetadata("hapticd-on-behalf-of", caller.name);
  context.AddMetadata("hapticd-browser", caller.peer);
  if (!caller.serial.empty()) context.AddMetadata("hapticd-on-behalf-of-serial", caller.serial);
  return true;
}

}  // namespace hapticd::console
