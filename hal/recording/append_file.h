#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hal/error.h"

namespace hapticd::recording {

/// A file that grows at its end. Nothing is kept back: what append() took is the kernel's, and survives the
/// process. As long as it is open no other process can resume() it. One thread; sync() may be called by
/// another.
class AppendFile {
 public:
  /// Makes a new file; an error if it exists, or cannot be made.
  static hal::Result<AppendFile> create(const std::string& path);
  /// Opens one to go on behind its first `size` bytes; what follows is cut off. An error if another process
  /// has it open for writing.
  static hal::Result<AppendFile> resume(const std::string& path, std::uint64_t size);
  /// Opens one to go on at its end, or makes it. An error if a link, a pipe or a device has this name, or
  /// another process has it open for writing.
  static hal::Result<AppendFile> open_or_create(const std::string& path);
  AppendFile(AppendFile&& other) noexcept
      : path_(std::move(other.path_)),
        descriptor_(std::exchange(other.descriptor_, -1)),
        size_(other.size_) {}
  AppendFile& operator=(AppendFile&&) = delete;
  ~AppendFile();

  /// Appends all of the bytes, or none of them and returns an error. The error says whether the disk is full.
  std::optional<hal::Error> append(std::string_view bytes);
  /// Cuts the file.
  std::optional<hal::Error> truncate(std::uint64_t size);
  /// Returns when all that was appended before is on the disk.
  std::optional<hal::Error> sync();

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

 private:
  AppendFile(std::string path, int descriptor, std::uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

  /// Keeps other processes from writing it.
  std::optional<hal::Error> lock();

  std::string path_;
  int descriptor_;
  std::uint64_t size_;
};

}  // namespace hapticd::recording
