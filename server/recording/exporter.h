#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "server/session/caller.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// What a client asks for; see ExportRequest of the program.
struct ExportOrder {
  std::string format;  ///< "hdf5" or "csv"
  std::vector<std::string> columns;
  double from_s = 0.0;
  double to_s = 0.0;
  std::uint32_t decimation = 1;
};

/// Exports and uploads leave so many times [recording] keep_free_mb: they must not be what ends a recording.
inline constexpr double kRoomFactor = 2.0;

/// A file that is deleted with this object.
class TemporaryExport {
 public:
  explicit TemporaryExport(std::string path) : path_(std::move(path)) {}
  ~TemporaryExport();
  TemporaryExport(TemporaryExport&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryExport& operator=(TemporaryExport&&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Has hapticd-export make a table of a recording, in a separate process: no failure of it is the daemon's.
/// `folder`: where the table is kept meanwhile; its disk keeps twice `keep_free_mb` free. Ends the program if
/// the caller leaves or the disk is full.
Outcome<TemporaryExport> export_recording(const std::string& recording, const std::string& folder,
                                          double keep_free_mb, const ExportOrder& order,
                                          const Caller& caller);

}  // namespace hapticd::server
