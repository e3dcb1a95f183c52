#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "hal/error.h"
#include "hal/recording/mcap_format.h"

namespace hapticd::recording {

/// What a reader wants to see of a file, in the order of the file. What is not set is skipped.
struct McapVisitor {
  std::function<void(const Schema&)> schema{};
  std::function<void(const Channel&)> channel{};
  std::function<void(const std::string& name, const Texts&)> metadata{};
  /// False ends the reading.
  std::function<bool(const Message&)> message{};
};

/// How the reading of a file ended.
struct McapEnd {
  /// The footer is there: the file was finished.
  bool is_finished = false;
  /// Why what follows Content::end cannot be read; empty if nothing follows.
  std::string damage;
  /// All up to the end, as a summary of it; only if all of it was read.
  Content content;
};

/// Whether a path may end in a symbolic link: not in a folder of which only the files themselves are shown.
enum class Links : std::uint8_t { kFollowed, kRefused };

/// Reads an MCAP file, also one that was not finished, was cut anywhere, or has other records than hapticd
/// writes. Chunks must be compressed with zstd or not at all.
class McapReader {
 public:
  /// Opens a file; an error if there is no file, it cannot be read, or does not begin like one.
  static hal::Result<McapReader> open(const std::string& path, Links links = Links::kFollowed);
  McapReader(McapReader&& other) noexcept
      : path_(std::move(other.path_)),
        descriptor_(std::exchange(other.descriptor_, -1)),
        size_(other.size_) {}
  McapReader& operator=(McapReader&&) = delete;
  ~McapReader();

  /// Reads from front to back, up to the last whole chunk. `from`: begins at this offset of a record instead.
  hal::Result<McapEnd> read(const McapVisitor& visitor, std::uint64_t from = 0) const;
  /// Summary that the file has of its content; nothing if it has none that is whole.
  std::optional<Content> summary() const;
  /// Record of metadata that the summary names; nothing if it is damaged.
  std::optional<Texts> metadata(const MetadataIndex& index) const;

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// True if a file begins like one; false also if it cannot be read.
  static bool is_mcap(const std::string& path);

 private:
  McapReader(std::string path, int descriptor, std::uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), size_(size) {}
  bool read_at(std::uint64_t offset, std::uint64_t count, std::string& out) const;

  std::string path_;
  int descriptor_;
  std::uint64_t size_;
};

}  // namespace hapticd::recording
