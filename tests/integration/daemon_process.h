#pragma once

#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace hapticd::test {

/// The built hapticd. Keeps its models in memory unless set otherwise.
class DaemonProcess : public ChildProcess {
 public:
  explicit DaemonProcess(std::vector<std::string> arguments);
  /// One that may not have more files and connections open at once.
  DaemonProcess(std::vector<std::string> arguments, int max_descriptors);
  /// One under a limit as prlimit takes it, e.g. "--as=1000000".
  DaemonProcess(const std::string& limit, std::vector<std::string> arguments);
  /// Waits for the line that shows the address, and returns the latter. Empty, and a failure of the test, if
  /// the process ended without it.
  std::string await_address();
  /// Has it end in order; a failure of the test if it does not.
  void end();
};

/// A client that subscribes, prints a line per batch and reads until it is killed.
std::string subscriber_binary();

}  // namespace hapticd::test
