#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "hal/daq/board.h"
#include "hal/lock/mutex.h"

namespace hapticd::phantom {

/// Writes zero volts when no command has come for a while, from its own thread. Every command arms it again;
/// while a cut is unread, commands must be withheld. The tick's side takes no lock.
class Watchdog {
 public:
  Watchdog(daq::Board& board, std::size_t outputs, double timeout_ms) noexcept;
  ~Watchdog();

  void start();
  void stop() noexcept;

  /// Notes that the tick has written volts.
  void fed(std::int64_t now_ns) noexcept;
  /// True once after each cut.
  bool take_cut() noexcept { return cut_.exchange(false, std::memory_order_acq_rel); }
  /// True if a cut has happened that was not reported yet.
  bool cut() const noexcept { return cut_.load(std::memory_order_acquire); }
  std::uint64_t cuts() const noexcept { return cuts_.load(std::memory_order_relaxed); }

 private:
  void run() noexcept;
  void cut_if_late() noexcept EXCLUDES(mutex_);

  daq::Board& board_;
  const std::size_t outputs_;
  const std::int64_t timeout_ns_;
  std::thread thread_;
  Mutex mutex_;  ///< never taken by the tick
  Condition stopped_;
  bool stopping_ GUARDED_BY(mutex_) = false;
  std::atomic<std::int64_t> fed_ns_{0};
  std::atomic<bool> armed_{false};
  std::atomic<bool> cut_{false};
  std::atomic<std::uint64_t> cuts_{0};
};

}  // namespace hapticd::phantom
