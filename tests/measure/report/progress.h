#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace hapticd::report {

/// A progress bar on the standard error stream: drawn over itself on a terminal, elsewhere a line every tenth
/// of the way. Several threads may show it.
class Progress {
 public:
  Progress(std::string what, std::size_t steps);
  /// Ends the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void step();

 private:
  void draw();

  std::mutex mutex_;
  std::string what_;
  std::size_t steps_;
  std::size_t done_ = 0;
  std::size_t reported_tenths_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace hapticd::report
