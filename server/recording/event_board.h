#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "hal/recording/block.h"

namespace hapticd::server {

/// What happened lately, for those who record. Any thread; never waits for a disk.
class EventBoard {
 public:
  static constexpr std::size_t kKept = 4096;

  void add(recording::Event event);
  /// Those that were added after the one of this number, which becomes that of the last. Events that are no
  /// longer kept are counted in `missed`.
  std::vector<recording::Event> after(std::uint64_t& number, std::uint64_t& missed) const;
  /// Number of the last one.
  std::uint64_t last() const;

 private:
  mutable std::mutex mutex_;
  std::deque<recording::Event> events_;
  std::uint64_t last_ = 0;
};

}  // namespace hapticd::server
