#pragma once

#include <memory>
#include <string>

#include "hal/error.h"

namespace hapticd::server {

/// Sole ownership of a unix socket's path, by a locked file next to it ("PATH.lock"). gRPC would silently
/// take the path away from a daemon that serves there. The kernel frees the lock however the process ends;
/// the file stays, for removing it would let two daemons each lock a separate file.
class InstanceLock {
 public:
  /// Locks, and removes a socket that an earlier daemon left. Refused if the path is not a socket.
  static hal::Result<std::unique_ptr<InstanceLock>> acquire(const std::string& socket_path);
  ~InstanceLock();
  InstanceLock(const InstanceLock&) = delete;
  InstanceLock& operator=(const InstanceLock&) = delete;

 private:
  explicit InstanceLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace hapticd::server
