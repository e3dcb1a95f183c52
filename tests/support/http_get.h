#pragma once

#include <cstdint>
#include <string>

namespace hapticd::test {

/// Whole answer, head and body, of this machine's server on `port`; empty if none listens.
std::string http_get(std::uint16_t port, const std::string& path);

}  // namespace hapticd::test
