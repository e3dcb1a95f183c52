#pragma once

namespace hapticd::cli {

/// Exit codes of hapticctl.
enum class ExitCode : int {
  kOk = 0,
  kRefused = 1,       ///< the daemon refused, or an identification failed
  kUsage = 2,         ///< the command line, or something on this machine: a file, a missing program
  kUnreachable = 3,   ///< no daemon there, or no answer in time
  kGaps = 4,          ///< the stream came with gaps
  kNotConverged = 5,  ///< an identification is over and has not converged: time, coverage, or cancelled;
                      ///< or a motion of the turntable or the guide was stopped by the user
};

inline constexpr const char* kExitCodeHelp =
    "Exit codes: 0 done; 1 refused by the daemon; 2 wrong usage, or a file or program of this machine is "
    "missing;\n"
    "            3 no daemon reached, or no answer in time; 4 the telemetry stream had gaps;\n"
    "            5 an identification ended without having converged, or Ctrl-C stopped the turntable or the guide.";

}  // namespace hapticd::cli
