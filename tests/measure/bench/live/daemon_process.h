#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/measure/report/child_process.h"

namespace hapticd::bench {

/// Folder of the running program, where `hapticd` is too.
std::filesystem::path program_folder();

/// How the daemon is started: the simulated rig in real time, no models kept unless set otherwise, on a free
/// loopback port.
struct DaemonSetup {
  std::string scene = "tap_1d";
  int loop_cpu = -1;  ///< that the loop is pinned to and the daemon's other threads keep off; -1 = none
  std::string more_configuration{};  ///< further sections
  double rate_hz = 1000.0;
  std::string model_store = ":memory:";
  unsigned long max_descriptors = 0;  ///< that it may have open; 0 = what the system allows
};

/// The real daemon.
class DaemonProcess {
 public:
  /// Starts it and waits until it listens. Throws std::runtime_error with what it said if it does not.
  explicit DaemonProcess(std::filesystem::path log, const DaemonSetup& setup = {});

  /// "127.0.0.1:PORT".
  const std::string& address() const noexcept { return address_; }
  pid_t pid() const noexcept { return process_.pid(); }
  /// Asks it to end (SIGTERM) and returns its exit status, -1 when it did not end in ten seconds.
  int stop();

 private:
  std::filesystem::path log_;
  report::ChildProcess process_;
  std::string address_;
};

}  // namespace hapticd::bench
