#pragma once

#include <signal.h>

#include <string>

namespace hapticd::server {

/// All signals that end a process unless it says otherwise, and are no sign of a crash: a terminal that
/// closes (SIGHUP), Ctrl-\ (SIGQUIT), timers, limits, power failure, the real-time ones … Each leads to the
/// same orderly end, force first. SIGKILL cannot be among them. SIGHUP is left out where it is ignored
/// already: `nohup` asks for that.
sigset_t ending_signals();

/// Blocks them in this thread and in those it will start, so that only await_ending_signal() sees them;
/// ignores SIGPIPE and SIGXFSZ, which are the matter of the write that fails. Before there are threads.
void hold_back_ending_signals();

/// Waits for one of them, and returns it.
int await_ending_signal();

/// "SIGTERM"; of one that has no name its number.
std::string name_of_signal(int number);

}  // namespace hapticd::server
