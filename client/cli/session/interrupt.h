#pragma once

namespace hapticd::cli {

/// Makes SIGINT and SIGTERM ask for an orderly end from here on, instead of ending the program.
void catch_interrupts();
/// True once one of them came.
bool interrupted() noexcept;
/// True if it was SIGTERM: the program is to end, what runs in the daemon is not.
bool terminated() noexcept;

}  // namespace hapticd::cli
