#pragma once

#include <cstdint>
#include <string>

#include "client/cpp/client.h"

namespace hapticd::cli {

/// Writes the pieces of a file to `path`, which is replaced once all of it is there. Returns its bytes.
/// Throws what the stream throws, and LocalError when the file cannot be written or the user interrupts.
std::uint64_t download(client::RecordingStream stream, const std::string& path);

}  // namespace hapticd::cli
