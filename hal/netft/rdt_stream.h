#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/netft/latest_value.h"
#include "hal/netft/rdt_record.h"

namespace hapticd::netft {

/// Fx Fy Fz Tx Ty Tz, sensor axes.
template <class T>
using SixAxes = std::array<T, 6>;

/// What the stream has brought so far, as running totals: a tick takes the difference to the totals it saw
/// last, so that it misses no sample however late it comes and no queue can overflow. Sums wrap round, their
/// differences are right.
struct RdtTotals {
  std::uint32_t session = 0;  ///< which start() they count from; 0 = none yet
  std::uint64_t good = 0;     ///< records fit for use
  SixAxes<std::uint64_t> sum_counts{};
  SixAxes<std::int32_t> newest_counts{};  ///< of the newest good one
  std::uint64_t saturated = 0;            ///< records with a channel at its end of range
  std::uint64_t warned = 0;
  std::uint64_t faulty = 0;         ///< records the box itself calls unfit: in no sum
  std::uint64_t implausible = 0;    ///< times the numbers jumped or began again too often (RdtContinuity)
  std::int64_t newest_good_ns = 0;  ///< arrival, monotonic clock
  std::int64_t newest_ns = 0;       ///< arrival of the newest of any fitness
  /// Instants at which the good records were measured, by their numbers at the box's rate: since `base_ns`.
  std::int64_t base_ns = 0;
  std::uint64_t sum_since_base_ns = 0;
  std::int64_t newest_instant_ns = 0;  ///< of the newest good one
  SixAxes<double> bias_counts{};       ///< to be subtracted from a mean
  std::uint32_t bias_serial = 0;       ///< of the zero that bias_counts stands for
  double newtons_per_count = 0.0;
  double newton_millimetres_per_count = 0.0;
};

/// Everything that is counted, for reports. Written by the receiving thread, read by any.
struct RdtCounters {
  std::atomic<std::uint64_t> good{0};
  std::atomic<std::uint64_t> gaps{0};
  std::atomic<std::uint64_t> lost{0};
  std::atomic<std::uint64_t> duplicates{0};
  std::atomic<std::uint64_t> old{0};          ///< overtaken by newer ones
  std::atomic<std::uint64_t> unconfirmed{0};  ///< out of all order
  std::atomic<std::uint64_t> box_restarts{0};
  std::atomic<std::uint64_t> stream_restarts{0};  ///< numbers began again since we asked for the stream again
  std::atomic<std::uint64_t> implausible{0};      ///< see RdtTotals
  std::atomic<std::int64_t> last_implausible_ns{0};
  std::atomic<std::uint64_t> malformed{0};  ///< datagrams of no whole number of records
  std::atomic<std::uint64_t> foreign{0};    ///< datagrams from someone else
  std::atomic<std::uint64_t> saturated{0};
  std::atomic<std::uint64_t> warned{0};
  std::atomic<std::uint64_t> faulty{0};
  std::atomic<std::uint64_t> silences{0};
  std::atomic<std::uint64_t> requests{0};  ///< for the stream, the first included
  std::atomic<std::uint64_t> send_errors{0};
  std::atomic<std::uint64_t> exceptions{0};  ///< of the receiving thread, survived
  std::atomic<std::int64_t> last_silence_ns{0};
  std::atomic<std::uint32_t> recent_status{0};  ///< all status bits of the last second or two
  std::atomic<double> rate_hz{0.0};             ///< over the last second
  std::atomic<double> loss_share{0.0};          ///< over the last second
  std::atomic<bool> silent{false};
};

struct RdtStreamSettings {
  std::string address;  ///< a number, IPv4 or IPv6
  int port = 0;
  double newtons_per_count = 1.0;
  double newton_millimetres_per_count = 1.0;
  double rate_hz = 0.0;           ///< records a second as the box says; 0 = unknown
  SixAxes<double> bias_counts{};  ///< of an earlier bias that still holds
  std::uint32_t bias_serial = 0;
  SixAxes<double> range_counts{};  ///< a reading that reaches this is at its end of range
  std::chrono::nanoseconds stale_after{};
  std::chrono::nanoseconds retry_first{};
  std::chrono::nanoseconds retry_longest{};
  int fifo_priority = 0;
  std::function<void()> on_box_restart;  ///< called on the receiving thread; must not wait
};

/// The stream of records from a box: a socket and a thread of its own that asks for the stream, receives,
/// sorts out and totals up, and asks again, ever less often, while nothing comes. Asking again also wins the
/// stream back from another client: a box serves the client that asked last, and does not inform the others.
class RdtStream {
 public:
  RdtStream(LatestValue<RdtTotals>& to_tick, RdtCounters& counters);
  ~RdtStream();
  RdtStream(const RdtStream&) = delete;
  RdtStream& operator=(const RdtStream&) = delete;

  /// Opens the socket, starts the thread, asks for the stream. Only while stopped.
  std::optional<hal::Error> start(const RdtStreamSettings& settings);
  /// Reports the box to stop, ends the thread, closes the socket.
  void stop() noexcept;

  // While started, not on the receiving thread:
  RdtTotals totals();
  /// Zero is from now on what reads `bias_counts`; the serial number changes with the first sample that uses
  /// it.
  void set_bias(const SixAxes<double>& bias_counts, std::uint32_t serial);
  /// The zero was lost: nothing is known but that it is another one.
  void set_bias_serial(std::uint32_t serial);
  void send(RdtCommand command);

  /// What was asked of the system but not granted, with its remedy; empty when all was.
  const std::string& shortcoming() const noexcept { return shortcoming_; }

 private:
  class Receiver;
  LatestValue<RdtTotals>& to_tick_;
  RdtCounters& counters_;
  std::uint32_t session_ = 0;
  std::string shortcoming_;
  std::unique_ptr<Receiver> receiver_;
};

/// The monotonic clock that arrivals are measured with.
inline std::int64_t monotonic_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace hapticd::netft
