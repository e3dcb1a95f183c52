#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/daq/counter_unwrap.h"
#include "hal/error.h"
#include "hal/lock/mutex.h"
#include "hal/part_report.h"

namespace hapticd::daq {

inline constexpr std::size_t kGaugeInputs = 6;  ///< the first of each scan
inline constexpr std::size_t kSpareInputs = 3;  ///< at most; an instrument's, after the gauges'
inline constexpr std::size_t kMaxInputs = kGaugeInputs + kSpareInputs;
inline constexpr std::size_t kMaxOutputs = 4;   ///< three motors and one to spare
inline constexpr std::size_t kMaxCounters = 6;  ///< three joints and a gimbal

/// One scan of all analog inputs.
struct Scan {
  std::int64_t time_ns = 0;  ///< by Board::now_ns(), when it arrived
  std::array<double, kMaxInputs> volts{};
};

/// Result of read_scans().
struct ScanReading {
  std::size_t count = 0;       ///< scans written, oldest first
  bool overrun = false;        ///< the board's own buffer overflowed since the last call: scans are missing
  bool running = false;        ///< false: the acquisition has stopped, or the board is gone
  std::int64_t newest_ns = 0;  ///< arrival of the newest scan so far, even when `count` is 0
};

/// Properties of a board; final once it is engaged.
struct BoardInfo {
  std::string driver{};  ///< e.g. "comedi"
  std::string model{};   ///< reported by the board, e.g. "pci-6251"
  std::size_t inputs = 0;
  double input_low_v = -10.0;  ///< ends of the converter's range
  double input_high_v = 10.0;
  int input_bits = 16;
  double scan_rate_hz = 10000.0;
  std::size_t outputs = 0;
  double output_low_v = -10.0;
  double output_high_v = 10.0;
  int output_bits = 16;
  std::size_t counters = 0;
  int counter_bits = 32;  ///< a reading is in [0, 2^bits)
};

/// The two halves of a board, opened separately: a scene that needs only the sensor drives no motor.
enum class BoardUse : std::uint8_t {
  kInputs,  ///< streaming analog inputs
  kMotion,  ///< analog outputs and encoder counters
};

/// An analog and digital board: streaming analog inputs, analog outputs, encoder counters. One board may
/// serve a sensor, an instrument and a device at once. read_scans(), read_spare_inputs(), read_counters()
/// and write_volts() neither block, allocate nor take a lock; read_counters() has one caller, write_volts()
/// may have several (the tick and its watchdog), scans are read by one thread at a time; a second thread
/// that reads meanwhile gets none. This class does what is common to all boards: it counts users, checks
/// outputs, unwraps counters and keeps the spare inputs for the instrument.
class Board {
 public:
  virtual ~Board() = default;
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  /// Opens the half `use`, or returns why it cannot. Each engage() needs one release().
  std::optional<hal::Error> engage(BoardUse use);
  /// Releases a half; its last user closes it, and its outputs are then at zero volts.
  void release(BoardUse use) noexcept;

  virtual BoardInfo info() const = 0;
  /// Clock that stamps the scans, monotonic.
  virtual std::int64_t now_ns() const noexcept;

  /// Reads all scans since the last call, or the newest that fit. Not engaged: none, not running.
  ScanReading read_scans(std::span<Scan> scans) noexcept;
  /// Mean of the spare inputs, in the order of their channels, over the scans read since the last call;
  /// reads the scans itself if no other part has engaged the inputs. Returns the number of scans in the
  /// mean; 0 when none was finite.
  std::size_t read_spare_inputs(std::array<double, kSpareInputs>& mean_v) noexcept;
  /// Counters 0 … n-1 since they were engaged, unwrapped to 64 bits (correct while none moves by half its
  /// range between two calls). False: nothing was read.
  bool read_counters(std::span<std::int64_t> counts) noexcept;
  /// Writes volts to outputs 0 … n-1, clamped to the range. If any value is not finite, all outputs become
  /// zero and the result is false; also false when the board refuses them.
  bool write_volts(std::span<const double> volts) noexcept;

  /// Adds connection, findings and figures to the report of the part that uses the board. Any thread.
  virtual void describe(hal::PartReport& report) const = 0;

 protected:
  Board() = default;

  /// Opens a half, on the first engage(); close() comes after the last release() of a half. Never both at
  /// once.
  virtual std::optional<hal::Error> open(BoardUse use) = 0;
  virtual void close(BoardUse use) noexcept = 0;
  /// read_scans() of this board; by one thread at a time.
  virtual ScanReading take_scans(std::span<Scan> scans) noexcept = 0;
  /// Present counts, each in [0, 2^counter_bits).
  virtual bool read_raw_counters(std::span<std::uint64_t> raw) noexcept = 0;
  /// Puts out volts; they are finite and within the range.
  virtual bool put_volts(std::span<const double> volts) noexcept = 0;

  std::uint64_t refused_outputs() const noexcept { return refused_outputs_.load(std::memory_order_relaxed); }

 private:
  void keep_spare(std::span<const Scan> scans) noexcept;

  SerialMutex users_mutex_;
  std::array<int, 2> users_ GUARDED_BY(users_mutex_){};
  std::atomic<int> input_users_{0};  ///< users_ of the inputs

  std::atomic_flag reading_ = ATOMIC_FLAG_INIT;  ///< set while scans are being read; guards the members below
  std::array<double, kSpareInputs> spare_sum_v_{};
  std::size_t spare_scans_ = 0;
  std::atomic<std::int64_t> newest_ns_{0};
  std::array<CounterUnwrap, kMaxCounters> unwrap_{};
  std::atomic<bool> unwrap_again_{true};
  std::atomic<int> counter_bits_{32};
  std::atomic<double> output_low_v_{0.0};
  std::atomic<double> output_high_v_{0.0};
  std::atomic<std::uint64_t> refused_outputs_{0};
};

}  // namespace hapticd::daq
