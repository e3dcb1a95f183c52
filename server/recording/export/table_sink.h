#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/recording/block.h"
#include "hal/recording/bytes.h"

namespace hapticd::server {

/// A table in another format under way.
class TableSink {
 public:
  virtual ~TableSink() = default;
  virtual void add_metadata(const std::string& name, const recording::Texts& texts) = 0;
  virtual void add_event(const recording::Event& event) = 0;
  /// Adds a row; an error ends the export.
  virtual std::optional<hal::Error> add_row(const recording::Row& row) = 0;
  virtual std::optional<hal::Error> finish() = 0;
};

/// Error of a table that could not be written to its end: `failure` is errno, or 0 if it is not known.
hal::Error unwritten(const std::string& path, int failure);

/// A column that is written: its place in the row.
struct ExportColumn {
  std::size_t index = 0;
  recording::Column column;
};

}  // namespace hapticd::server
