#include "hal/recording/append_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace hapticd::recording {

namespace {

hal::Error file_error(const char* what, const std::string& path, int code) {
  switch (code) {
    case ENOSPC:
    case EDQUOT:
      return hal::Error::of(hal::ErrorCode::kFull, "the disk is full", path, std::strerror(code), "",
                            "make room there, then record again");
    case EFBIG:
      return {"the file reached the largest size that this process may write", path, std::strerror(code),
              "RLIMIT_FSIZE, LimitFSIZE= of the unit", "raise the limit, or record for a shorter time"};
    case EROFS:
    case EACCES:
    case EPERM:
      return {what, path, std::strerror(code), "a folder that hapticd may write to",
              "see its owner and rights, and ReadWritePaths= of the unit"};
    case ELOOP:
      return {what, path, "a link", "a regular file", "remove the link"};
    default:
      return {what, path, std::strerror(code), "", ""};
  }
}

}  // namespace

hal::Result<AppendFile> AppendFile::create(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0640);
  if (descriptor < 0) return file_error("the file cannot be made", path, errno);
  flock(descriptor, LOCK_EX | LOCK_NB);
  // Its name has to survive a loss of power as well.
  const std::string folder = path.find('/') == std::string::npos ? "." : path.substr(0, path.rfind('/') + 1);
  if (const int opened = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); opened >= 0) {
    fsync(opened);
    close(opened);
  }
  return AppendFile(path, descriptor, 0);
}

hal::Result<AppendFile> AppendFile::resume(const std::string& path, std::uint64_t size) {
  const int descriptor = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) return file_error("the file cannot be opened for writing", path, errno);
  AppendFile file(path, descriptor, size);
  if (auto error = file.lock()) return *error;
  if (auto error = file.truncate(size)) return *error;
  return file;
}

hal::Result<AppendFile> AppendFile::open_or_create(const std::string& path) {
  // Without O_NONBLOCK the open() of a pipe that nobody reads would not return.
  const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0640);
  if (descriptor < 0) return file_error("the file cannot be opened for writing", path, errno);
  AppendFile file(path, descriptor, 0);
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return file_error("the file cannot be examined", path, errno);
  if (!S_ISREG(status.st_mode)) {
    return hal::Error{"the file cannot be written", path, "a pipe or a device", "a regular file",
                      "remove what is there"};
  }
  if (auto error = file.lock()) return *error;
  file.size_ = static_cast<std::uint64_t>(status.st_size);
  return file;
}

std::optional<hal::Error> AppendFile::lock() {
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kInUse, "another process writes this file", path_,
                        std::strerror(errno), "", "wait for its end");
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::optional<hal::Error> AppendFile::append(std::string_view bytes) {
  std::uint64_t at = size_;
  while (!bytes.empty()) {
    const ssize_t written = pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      hal::Error error = file_error("the file cannot be written", path_, written == 0 ? ENOSPC : errno);
      // Half of a record is worth nothing, and a reader would have to find that out.
      if (at != size_) static_cast<void>(truncate(size_));
      return error;
    }
    at += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  size_ = at;
  return std::nullopt;
}

std::optional<hal::Error> AppendFile::truncate(std::uint64_t size) {
  if (ftruncate(descriptor_, static_cast<off_t>(size)) != 0) {
    return file_error("the file cannot be cut", path_, errno);
  }
  size_ = size;
  return std::nullopt;
}

std::optional<hal::Error> AppendFile::sync() {
  if (fdatasync(descriptor_) == 0) return std::nullopt;
  return file_error("the file cannot be written to the disk", path_, errno);
}

}  // namespace hapticd::recording
