#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "hal/error.h"

namespace hapticd::server {

/// A file that exists while the daemon runs, and stays if it ends in no orderly way: the next run finds it
/// and starts without force. It also stays if such a run ends before someone has cleared.
class RunMarker {
 public:
  static constexpr const char* kFileName = "running";

  /// Looks for the file of an earlier run in `folder`, and writes that of this one.
  static hal::Result<std::unique_ptr<RunMarker>> leave_in(const std::string& folder);

  /// True if an earlier run did not end in an orderly way.
  bool found() const { return found_; }
  const std::string& path() const { return path_; }
  /// Notes that someone has cleared: a clean end may remove the file. Any thread.
  void acknowledge() { acknowledged_.store(true); }
  /// Marks the end of an orderly shutdown.
  void end_cleanly();

 private:
  RunMarker(std::string path, bool found) : path_(std::move(path)), found_(found), acknowledged_(!found) {}

  const std::string path_;
  const bool found_;
  std::atomic<bool> acknowledged_;
};

}  // namespace hapticd::server
