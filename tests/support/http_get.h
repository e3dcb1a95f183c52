#pragma once

#include <cstdint>
#include <string>

namespace hapticd::test {

/// The whole answer, head and body, of this machine's server on `port`; empty where none listens.
std::string http_get(std::uint16_t port, const std::string& path);

}  // namespace hapticd::test
