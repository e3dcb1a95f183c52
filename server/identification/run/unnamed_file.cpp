#include "server/identification/run/unnamed_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace hapticd::server {

namespace {

/// Opens a file on file systems that make no unnamed files (O_TMPFILE): the name lives for a moment only.
int open_and_unlink(const std::string& folder) {
  std::string name = folder + "/hapticd-XXXXXX";
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor >= 0) unlink(name.c_str());
  return descriptor;
}

}  // namespace

hal::Result<UnnamedFile> UnnamedFile::create() {
  std::error_code failure;
  std::string folder = std::filesystem::temp_directory_path(failure).string();
  if (failure)
    return hal::Error{"no temporary file can be made", "$TMPDIR", failure.message(), "a folder", ""};
  int descriptor = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor < 0) descriptor = open_and_unlink(folder);
  if (descriptor < 0)
    return hal::Error{"no temporary file can be made", folder, std::strerror(errno), "", ""};
  return UnnamedFile(descriptor, std::move(folder));
}

UnnamedFile::UnnamedFile(UnnamedFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), folder_(std::move(other.folder_)) {}

UnnamedFile& UnnamedFile::operator=(UnnamedFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(folder_, other.folder_);
  return *this;
}

UnnamedFile::~UnnamedFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::optional<hal::Error> UnnamedFile::append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      return hal::Error{"the temporary file cannot be written", folder_, std::strerror(errno), "", ""};
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return std::nullopt;
}

std::string UnnamedFile::path() const {
  return "/proc/self/fd/" + std::to_string(descriptor_);
}

}  // namespace hapticd::server
