#pragma once

#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// An identity as a line of [access.denied] names it, in the one spelling that the daemon compares:
/// "user:NAME", "unix:GROUP", "local", the URI of a certificate, or "serial:" and its number in capitals.
/// Every usual spelling of a number is understood: small letters, colons, leading zeros, "serial=" and "0x".
/// A text that cannot be an identity is refused by the name of its `key`.
hal::Result<std::string> denied_identity(std::string_view text, const std::string& key);

/// Refuses what cannot be the name of a user or group of this machine.
hal::Result<std::string> local_name(std::string_view text, const std::string& key);

/// Refuses what cannot be a name in a certificate, which is a URI.
hal::Result<std::string> certificate_uri(std::string_view text, const std::string& key);

}  // namespace hapticd::server
