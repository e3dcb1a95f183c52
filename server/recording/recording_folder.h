#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "server/config/recording_section.h"
#include "server/recording/recording_info.h"

namespace hapticd::server {

/// A folder of recordings that hapticd names itself, and what may be in it. Any thread.
class RecordingFolder {
 public:
  struct Limits {
    double quota_mb = 0.0;
    WhenFull when_full = WhenFull::kStop;
    double keep_free_mb = 0.0;
    std::string quota_key;  ///< for errors: "[recording] quota_mb"
    /// Name of the files that make room before all others, and for which no other does. Of the others one of
    /// the name that takes most makes room. Empty: the oldest does.
    std::string goes_first{};
  };
  RecordingFolder(std::string path, Limits limits) : path_(std::move(path)), limits_(std::move(limits)) {}

  /// Makes the folder; an error if it cannot be written to.
  std::optional<hal::Error> open() const;
  /// Finishes the files that are not being written and that have no end; what was done, one line each.
  std::vector<std::string> repair_all() const;

  /// Lists them, oldest first.
  std::vector<RecordingInfo> list() const;
  /// The path of an id that is there, a regular file; nothing for any other text.
  std::optional<std::string> find(const std::string& id) const;
  std::vector<std::string> ids() const;
  /// The path of a new file, which counts as the newest whatever the clock says; see file_id().
  std::string new_path(std::int64_t unix_ns, const std::string& name) const;
  std::optional<hal::Error> remove(const std::string& id) const;

  /// Makes room as the limits say, never of `kept` (an id), and for `first_mb` more: what a new recording
  /// needs for its first seconds. An error if none can be made: which limit, how much there is, what to do.
  std::optional<hal::Error> make_room(const std::string& kept, double first_mb = 0.0) const;

  const std::string& path() const { return path_; }
  const Limits& limits() const { return limits_; }
  /// Size of all files, in 10⁶ bytes.
  double used_mb() const;

 private:
  struct File {
    std::string id;
    std::uint64_t bytes;
  };
  std::vector<File> files() const;

  const std::string path_;
  const Limits limits_;
};

}  // namespace hapticd::server
