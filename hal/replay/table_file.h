#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/csv_file.h"

namespace hapticd::replay {

/// A recording as a table of numbers, whatever its format: CSV, or MCAP as hapticd itself records. Which of
/// them the file's first bytes show.
class TableFile {
 public:
  /// Visitor of a row, as CsvFile's; the number of a row of an MCAP recording takes the place of the line.
  using RowVisitor = CsvFile::RowVisitor;

  /// Errors: those of CsvFile; of an MCAP file, that it has no telemetry of hapticd; HDF5. `format`: of CSV
  /// only.
  static hal::Result<std::unique_ptr<TableFile>> open(const std::string& path, const CsvFormat& format = {});
  virtual ~TableFile() = default;

  virtual const std::vector<std::string>& columns() const noexcept = 0;
  /// "recording 'PATH'", with the line or the row if one is given; for errors.
  virtual std::string place(std::size_t line = 0) const = 0;
  /// Reads all rows; only the cells of `columns` (indices into columns()). Refuses cells that are not finite.
  /// Call it once.
  virtual std::optional<hal::Error> read_rows(std::span<const std::size_t> columns,
                                              const RowVisitor& visit) = 0;
};

/// True if a file begins like HDF5, which is not read here.
bool is_hdf5(const std::string& path);
/// The refusal of such a file.
hal::Error hdf5_is_not_read(std::string place);

/// The refusal of a row whose time is not later than that of the row before.
hal::Error time_does_not_increase(double now_s, double last_s, std::string place);

/// Rows of an MCAP recording; nothing if the file is none.
std::optional<std::size_t> rows_of_mcap(const std::string& path);

}  // namespace hapticd::replay
