#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/study/report/child_process.h"

namespace hapticd::bench {

/// Folder of the running program, where `hapticd` is too.
std::filesystem::path program_folder();

/// The real daemon on the simulated rig in real time, with a scene loaded and no models kept, on a free loopback port.
class DaemonProcess {
 public:
  /// Starts it and waits until it listens. Throws std::runtime_error with what it said where it does not.
  explicit DaemonProcess(std::filesystem::path log, const std::string& scene = "tap_1d");

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
