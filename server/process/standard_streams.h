#pragma once

namespace hapticd::server {

/// Opens /dev/null for each of standard input, output and error that the process was started without. Else
/// the next file, socket or board that is opened would have its number, and get what is written to the log.
void open_standard_streams() noexcept;

}  // namespace hapticd::server
