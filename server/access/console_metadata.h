#pragma once

namespace hapticd::server {

/// Metadata of calls from the console, which come through a channel within the process: the secret pass of a
/// session (see ConsoleDoor), and the address of the browser, for the audit log.
inline constexpr const char* kConsolePassKey = "hapticd-console-pass";
inline constexpr const char* kConsolePeerKey = "hapticd-console-peer";

}  // namespace hapticd::server
