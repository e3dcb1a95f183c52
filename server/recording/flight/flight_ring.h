#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/recording/block.h"
#include "hal/recording/bytes.h"
#include "server/recording/recording_sources.h"

namespace hapticd::server {

/// The last rows of all that is recorded, in a file of fixed size that outlives the process: what was written
/// is the kernel's, whatever becomes of the daemon. Written with pwrite and not through a mapping, so that it
/// is neither resident nor locked memory of the daemon, and a full disk is an error and no signal. The file
/// is as long as it will ever be from the beginning. One thread writes; another may read.
class FlightRing {
 public:
  /// What is known of the run, by the name of the metadata.
  using Notes = std::map<std::string, recording::Texts>;

  /// Makes a ring at `path`. An error if there is no room, or another process has it.
  static hal::Result<std::unique_ptr<FlightRing>> create(const std::string& path,
                                                         const std::vector<recording::Column>& columns,
                                                         std::uint64_t capacity_rows, double rate_hz);
  /// Opens a ring that another run left. An error if it is not a ring, is damaged, or its daemon still runs.
  static hal::Result<std::unique_ptr<FlightRing>> open_left(const std::string& path);
  /// Closes the ring; the file stays.
  ~FlightRing();
  FlightRing(const FlightRing&) = delete;
  FlightRing& operator=(const FlightRing&) = delete;

  /// Appends whole rows; the oldest give way.
  std::optional<hal::Error> write(std::string_view rows);
  std::optional<hal::Error> set_anchor(const ClockAnchor& anchor);
  /// Sets the notes, cut to what there is room for.
  std::optional<hal::Error> set_notes(const Notes& notes);
  /// Deletes the file: the run ends in order.
  void remove();

  const std::vector<recording::Column>& columns() const { return columns_; }
  std::size_t row_bytes() const { return columns_.size() * recording::kCellBytes; }
  double rate_hz() const { return rate_hz_; }
  std::uint64_t capacity_rows() const { return capacity_rows_; }
  /// Rows that were ever written; the newest has this number less one.
  std::uint64_t written() const;
  /// Rows `first` … `first + count - 1`; false if some were overwritten meanwhile.
  bool read(std::uint64_t first, std::uint64_t count, std::string& rows) const;
  ClockAnchor anchor() const;
  Notes notes() const;

 private:
  struct Head;
  FlightRing(std::string path, int descriptor);
  std::optional<hal::Error> write_at(std::uint64_t offset, std::string_view bytes);
  bool read_at(std::uint64_t offset, std::uint64_t count, std::string& bytes) const;
  bool read_head(Head& head) const;

  const std::string path_;
  const int descriptor_;
  std::vector<recording::Column> columns_;
  std::uint64_t capacity_rows_ = 0;
  double rate_hz_ = 0.0;
};

}  // namespace hapticd::server
