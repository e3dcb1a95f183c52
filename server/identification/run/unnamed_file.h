#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// A temporary file without a name: the kernel takes it away with the last descriptor, however the process
/// ends. Written by one thread, then read by any.
class UnnamedFile {
 public:
  /// In $TMPDIR, else in /tmp; the error names the folder and what the system says.
  static hal::Result<UnnamedFile> create();
  UnnamedFile(UnnamedFile&& other) noexcept;
  UnnamedFile& operator=(UnnamedFile&& other) noexcept;
  ~UnnamedFile();

  /// All of it, or what the system says.
  std::optional<hal::Error> append(std::string_view bytes);
  /// By which this process may open it for reading, as often as it likes, while this lives.
  std::string path() const;

 private:
  UnnamedFile(int descriptor, std::string folder) : descriptor_(descriptor), folder_(std::move(folder)) {}
  int descriptor_ = -1;
  std::string folder_;
};

}  // namespace hapticd::server
