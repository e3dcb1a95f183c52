#include "server/process/run_marker.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace hapticd::server {

hal::Result<std::unique_ptr<RunMarker>> RunMarker::leave_in(const std::string& folder) {
  std::string path = folder + "/" + kFileName;
  const bool found = access(path.c_str(), F_OK) == 0;
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
  if (descriptor < 0) {
    return hal::Error{"cannot write the file that marks a running daemon", path, std::strerror(errno),
                      "a folder that the daemon may write", "StateDirectory= of the unit makes one"};
  }
  // Only for people to read: that the file exists is what counts.
  const std::string pid = std::to_string(getpid()) + "\n";
  [[maybe_unused]] const bool written =
      ftruncate(descriptor, 0) == 0 && write(descriptor, pid.data(), pid.size()) > 0;
  fsync(descriptor);  // a loss of power is to leave it
  close(descriptor);
  if (const int opened = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); opened >= 0) {
    fsync(opened);
    close(opened);
  }
  return std::unique_ptr<RunMarker>(new RunMarker(std::move(path), found));
}

void RunMarker::end_cleanly() {
  if (acknowledged_.load()) unlink(path_.c_str());
}

}  // namespace hapticd::server
