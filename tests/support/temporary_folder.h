#pragma once

#include <string>

namespace hapticd::test {

/// Folder of files in memory, for what several processes map and write every millisecond: a page of a file on
/// a disk is held for seconds while a busy disk writes it back. The folder for temporary files if there is
/// none.
std::string memory_folder();

/// All that is in a file; empty if there is none.
std::string file_text(const std::string& path);

/// Separate folder for a test, removed with all in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  explicit TemporaryFolder(const std::string& parent);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string path(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }
  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const;

 private:
  std::string path_;
};

}  // namespace hapticd::test
