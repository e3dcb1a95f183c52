#include "server/process/instance_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace hapticd::server {

namespace {

/// True if a process listens there: a lock file may have been deleted under its holder.
bool is_served(const std::string& socket_path) {
  sockaddr_un address{};
  if (socket_path.size() >= sizeof address.sun_path) return false;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, socket_path.c_str(), socket_path.size() + 1);
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return false;
  const bool refused =
      connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
      errno != EAGAIN;  // someone's queue is full
  close(descriptor);
  return !refused;
}

/// The process id in the lock file; "?" if the holder has not written it yet.
std::string holder(int descriptor) {
  std::array<char, 32> text{};
  const ssize_t length = pread(descriptor, text.data(), text.size(), 0);
  std::string pid(text.data(), length > 0 ? static_cast<std::size_t>(length) : 0);
  while (!pid.empty() && pid.back() == '\n') pid.pop_back();
  return pid.empty() ? "?" : pid;
}

}  // namespace

hal::Result<std::unique_ptr<InstanceLock>> InstanceLock::acquire(const std::string& socket_path) {
  const std::string lock_path = socket_path + ".lock";
  const int descriptor = open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (descriptor < 0) {
    return hal::Error{"cannot open the lock file of the unix socket", lock_path, std::strerror(errno), "",
                      "check the folder and its permissions"};
  }
  std::unique_ptr<InstanceLock> lock(new InstanceLock(descriptor));
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    return hal::Error{"another hapticd serves this unix socket", socket_path, "process " + holder(descriptor),
                      "one daemon per socket", "stop it, or choose another path with --unix"};
  }
  const std::string pid = std::to_string(getpid()) + "\n";
  // Only for people to read: the lock holds with or without it.
  [[maybe_unused]] const bool written =
      ftruncate(descriptor, 0) == 0 && pwrite(descriptor, pid.data(), pid.size(), 0) > 0;

  struct stat present {};
  if (lstat(socket_path.c_str(), &present) == 0) {
    if (!S_ISSOCK(present.st_mode)) {
      return hal::Error{"the path of the unix socket is taken by something that is no socket", socket_path,
                        "", "a path that is free, or a socket left behind",
                        "choose another path with --unix"};
    }
    if (is_served(socket_path)) {
      return hal::Error{"another hapticd serves this unix socket, though its lock file is gone", socket_path,
                        "", "one daemon per socket", "stop it, or choose another path with --unix"};
    }
    unlink(socket_path.c_str());
  }
  return lock;
}

InstanceLock::~InstanceLock() {
  close(descriptor_);
}

}  // namespace hapticd::server
