#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hapticd::test {

/// A child process whose output is read. Killed and collected at the end of its scope at the latest.
class ChildProcess {
 public:
  ChildProcess(const std::string& program, std::vector<std::string> arguments);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  /// The next line of standard output; empty at its end.
  std::string read_line();
  void signal(int number) const;
  /// Waits for the end. The exit code, or minus the signal that ended it.
  int wait();
  /// All of standard error; after wait().
  const std::string& errors() const { return errors_; }
  /// What was not read by read_line(); after wait().
  const std::string& output() const { return output_; }

 private:
  pid_t pid_ = -1;
  int output_pipe_ = -1;
  int error_pipe_ = -1;
  std::string output_;
  std::string errors_;
};

/// Result of a child process that has ended.
struct Ran {
  int code = 0;
  std::string output;
  std::string errors;
};
Ran run_to_the_end(const std::string& program, std::vector<std::string> arguments);

}  // namespace hapticd::test
