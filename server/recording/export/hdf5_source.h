#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/recording/block.h"
#include "server/recording/export/hdf5_handle.h"

namespace hapticd::server {

/// The table of a file that Hdf5Sink wrote. Its events and metadata are not read.
class Hdf5Source {
 public:
  static bool is_hdf5(const std::string& path);
  /// Errors: no table of hapticd in it; columns of different lengths.
  static hal::Result<Hdf5Source> open(const std::string& path);

  /// "tick", "time_ns", then the others by their names.
  const std::vector<recording::Column>& columns() const { return columns_; }
  /// `take_row` returns false to end the reading.
  std::optional<hal::Error> read(const std::function<bool(const recording::Row&)>& take_row) const;

 private:
  Hdf5Source(std::string path, Hdf5Handle file) : path_(std::move(path)), file_(std::move(file)) {}
  std::optional<hal::Error> add_column(hid_t group, const std::string& name);

  std::string path_;
  Hdf5Handle file_;
  std::vector<recording::Column> columns_;
  std::vector<Hdf5Handle> datasets_;
  hsize_t rows_ = 0;
};

}  // namespace hapticd::server
