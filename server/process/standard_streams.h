#pragma once

#include <string_view>

namespace hapticd::server {

/// Opens /dev/null for each of standard input, output and error that the process was started without. Else
/// the next file, socket or board that is opened would have its number, and get what is written to the log.
void open_standard_streams() noexcept;

/// Writes a line to a stream, or nothing if that would have to wait: a pipe or terminal whose reader does
/// not read must hold up neither a signal nor the end. Async-signal-safe.
void write_if_ready(int stream, std::string_view line) noexcept;

}  // namespace hapticd::server
