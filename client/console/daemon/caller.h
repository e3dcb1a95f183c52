#pragma once

#include <string>
#include <string_view>

namespace grpc {
class ClientContext;
}

namespace hapticd::console {

/// The person of a call, as its metadata has it.
struct Caller {
  std::string name;    ///< identity that the call is made on behalf of; empty: the console itself
  std::string serial;  ///< of the certificate that the browser has shown, hexadecimal; empty: none
  std::string peer;    ///< address of the browser
  std::string lease;   ///< token; empty, or a text that cannot be one: none
};

/// True if a text has the form of a lease's token, or of a key that opens the page: 32 hexadecimal digits.
bool is_token(std::string_view text);
/// False if gRPC cannot send who the call is for: then the call must not be made.
bool fill(grpc::ClientContext& context, const Caller& caller);

}  // namespace hapticd::console
