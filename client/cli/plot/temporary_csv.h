#pragma once

#include <string>

namespace hapticd::cli {

/// A file in a folder of this program's own, deleted with the object: others can put no link in its way.
class TemporaryCsv {
 public:
  /// Throws LocalError if no such folder can be made.
  TemporaryCsv();
  ~TemporaryCsv();
  TemporaryCsv(const TemporaryCsv&) = delete;
  TemporaryCsv& operator=(const TemporaryCsv&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string folder_;
  std::string path_;
};

}  // namespace hapticd::cli
