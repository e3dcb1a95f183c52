#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/daq/board.h"
#include "hal/daq/board_config.h"
#include "hal/daq/comedi_channels.h"
#include "hal/daq/scan_ring.h"
#include "hal/lock/mutex.h"

namespace hapticd::daq {

/// The streaming command of a comedi board: its own thread waits for scans, makes volts of them and puts them
/// in a wait-free ring. When the stream ends, stalls or overflows it is started again, the board's node
/// opened again if need be, at intervals that grow from 0.1 s to 5 s.
class ComediAcquisition {
 public:
  explicit ComediAcquisition(const BoardConfig& config);
  ~ComediAcquisition();

  /// Starts the stream and the thread.
  std::optional<hal::Error> start();
  void stop() noexcept;

  /// Scans for the tick; wait-free.
  ScanReading read(std::span<Scan> scans) noexcept;
  void describe(hal::PartReport& report) const;

  /// Range from low_v() to high_v() and resolution of the channels, as of the last successful start.
  double low_v() const noexcept { return low_v_.load(std::memory_order_relaxed); }
  double high_v() const noexcept { return high_v_.load(std::memory_order_relaxed); }
  int bits() const noexcept { return bits_.load(std::memory_order_relaxed); }

 private:
  struct Stream {
    ComediHandle device;
    int file = -1;
    bool wide = false;  ///< samples of 32 bits, not 16
    std::vector<AnalogChannel> channels;
    std::vector<unsigned> channel_list;
  };
  enum class Outcome : std::uint8_t { kDelivered, kSilent, kEnded, kOverrun };

  hal::Result<Stream> open_stream() const;
  void run(Stream stream) noexcept;
  /// Takes the available scans; waits for a short, bounded time.
  Outcome take(Stream& stream) noexcept;
  void convert(const Stream& stream, std::size_t scans, std::int64_t now_ns) noexcept;
  void adopt(const Stream& stream) noexcept;
  /// False when it was asked to stop in the meantime.
  bool pause(std::chrono::milliseconds time) noexcept;
  void raise_priority() noexcept;

  const BoardConfig config_;
  ScanRing ring_;
  std::thread thread_;
  Mutex mutex_;  ///< never taken by the tick
  Condition stopped_;
  bool stopping_ GUARDED_BY(mutex_) = false;

  std::vector<unsigned char> bytes_;
  std::size_t filled_ = 0;
  std::int64_t silent_since_ns_ = 0;

  std::atomic<bool> running_{false};
  std::atomic<bool> overrun_{false};
  std::atomic<bool> priority_refused_{false};
  std::atomic<std::int64_t> newest_ns_{0};
  std::atomic<double> low_v_{-10.0};
  std::atomic<double> high_v_{10.0};
  std::atomic<int> bits_{16};
  std::atomic<std::uint64_t> scans_{0};
  std::atomic<std::uint64_t> unread_{0};
  std::atomic<std::uint64_t> restarts_{0};
  std::atomic<std::uint64_t> overruns_{0};
};

}  // namespace hapticd::daq
