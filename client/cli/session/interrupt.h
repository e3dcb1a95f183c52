#pragma once

namespace hapticd::cli {

/// From here on SIGINT and SIGTERM ask for an orderly end instead of ending the program.
void catch_interrupts();
/// True once one of them came.
bool interrupted() noexcept;
/// True where it was SIGTERM: the program is to end, what runs in the daemon is not.
bool terminated() noexcept;

}  // namespace hapticd::cli
