#pragma once

#include <signal.h>

#include <string>

namespace hapticd::server {

/// All signals that end a process by default and are not a crash: a terminal that
/// closes (SIGHUP), Ctrl-\ (SIGQUIT), timers, limits, power failure, the real-time ones … Each leads to the
/// same orderly end, force first. SIGKILL cannot be caught. SIGHUP is left out if it is ignored already, as
/// under `nohup`.
sigset_t ending_signals();

/// Signals that take the force away, and nothing else: SIGUSR1, and SIGTSTP (Ctrl-Z), which would suspend the
/// process while the device keeps its last force. They are blocked with the ending ones, and read by
/// signalfd().
sigset_t stopping_signals();

/// Blocks both in this thread and in those it will start, so that only await_ending_signal() and signalfd()
/// see them; ignores SIGPIPE and SIGXFSZ, which the failing write reports, and SIGTTIN and SIGTTOU, which
/// would suspend the process. Call it before there are threads.
void hold_back_ending_signals();

/// Waits for one of them, and returns it.
int await_ending_signal();

/// "SIGTERM"; the number of one that has no name.
std::string name_of_signal(int number);

}  // namespace hapticd::server
