#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::report {

/// How to start a program.
struct Launch {
  std::vector<std::string>
      command;                     ///< the program (searched in PATH) and its arguments; no shell in between
  std::filesystem::path output{};  ///< file for what it prints on both streams; empty = thrown away
  bool clear_environment = false;  ///< start it without any environment variable
  std::filesystem::path folder{};  ///< to start it in; empty = ours
};

/// A program we started, ended at the latest with this object. Only this very process is ever signalled.
class ChildProcess {
 public:
  /// Throws std::system_error when it cannot be started; its code is no_such_file_or_directory if the program
  /// is not installed.
  explicit ChildProcess(const Launch& launch);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const noexcept { return pid_; }
  void signal(int number) noexcept;
  /// Waits for its exit status, 128 + the signal that ended it; none when it still runs after `timeout`.
  std::optional<int> wait(std::chrono::milliseconds timeout) noexcept;

 private:
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// What became of a program that ran to its end.
struct ProgramRun {
  bool installed = true;  ///< false: the program does not exist on this machine
  int status = -1;        ///< exit status; -1 when it did not end in time and was killed
  std::string output;     ///< both streams
};

ProgramRun run_program(Launch launch, std::chrono::seconds timeout);

}  // namespace hapticd::report
