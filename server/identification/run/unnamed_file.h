#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// Temporary file without a name: the kernel removes it with the last descriptor, however the process ends.
/// Written by one thread, then read by any.
class UnnamedFile {
 public:
  /// Makes a file in $TMPDIR, else in /tmp; the error names the folder and what the system says.
  static hal::Result<UnnamedFile> create();
  const std::string& folder() const { return folder_; }
  UnnamedFile(UnnamedFile&& other) noexcept;
  UnnamedFile& operator=(UnnamedFile&& other) noexcept;
  ~UnnamedFile();

  /// Appends all of it; otherwise returns what the system says.
  std::optional<hal::Error> append(std::string_view bytes);
  /// Path by which this process may open it for reading, as often as it likes, while this lives.
  std::string path() const;

 private:
  UnnamedFile(int descriptor, std::string folder) : descriptor_(descriptor), folder_(std::move(folder)) {}
  int descriptor_ = -1;
  std::string folder_;
};

}  // namespace hapticd::server
