#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "hal/lock/mutex.h"
#include "hal/recording/block.h"

namespace hapticd::server {

struct NumberedEvent {
  std::uint64_t number = 0;  ///< counts from 1 since the daemon started
  recording::Event event;
  bool is_in_records = false;  ///< found in the loop's records: whoever records them finds it, too
};

/// Events of late, for those who record and those who watch. Any thread; never waits for a disk. The kinds of
/// which there may be many a second have a separate place: they drive out no others.
class EventLog {
 public:
  static constexpr std::size_t kKept = 3000;
  static constexpr std::size_t kKeptOfFrequent = 1000;  ///< targets and overruns

  void add(recording::Event event) { add(std::move(event), false); }
  /// Adds an event that was found in the loop's records.
  void add_from_records(recording::Event event) { add(std::move(event), true); }

  /// Events for those who record: those that were added after the one of this number, which becomes that of
  /// the last, without what is in the records. Events that are no longer kept are counted in `missed`.
  std::vector<recording::Event> after(std::uint64_t& number, std::uint64_t& missed) const;
  /// Events for those who watch: all that are kept after this number, in their order.
  std::vector<NumberedEvent> all_after(std::uint64_t number) const;
  /// Number of the last one.
  std::uint64_t last() const;
  /// Waits until there is one after this number, for as long as that at most; false once end() was called.
  bool await_after(std::uint64_t number, std::chrono::milliseconds timeout) const;
  /// Wakes those who wait; they wait no more.
  void end();

 private:
  void add(recording::Event event, bool is_in_records);
  /// Collects by number.
  std::vector<NumberedEvent> collect_locked(std::uint64_t number) const REQUIRES(mutex_);

  mutable Mutex mutex_;
  mutable Condition added_;
  std::array<std::deque<NumberedEvent>, 2> events_ GUARDED_BY(mutex_);  ///< the frequent ones, and all others
  std::uint64_t last_ GUARDED_BY(mutex_) = 0;
  bool ended_ GUARDED_BY(mutex_) = false;
};

}  // namespace hapticd::server
