#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/latest_value.h"
#include "hal/lock/callback.h"
#include "hal/monotonic_clock.h"
#include "hal/netft/rdt_record.h"

namespace hapticd::netft {

/// Fx Fy Fz Tx Ty Tz, sensor axes.
template <class T>
using SixAxes = std::array<T, 6>;

/// Running totals of the stream. A tick takes the difference from the totals it saw last, so it misses no
/// sample however late it comes, and no queue can overflow. Sums may wrap; their differences are correct.
struct RdtTotals {
  std::uint32_t session = 0;  ///< number of the start() they count from; 0 = none yet
  std::uint64_t good = 0;     ///< usable records
  SixAxes<std::uint64_t> sum_counts{};
  SixAxes<std::int32_t> newest_counts{};  ///< of the newest good one
  std::uint64_t saturated = 0;            ///< records with a channel at its end of range
  std::uint64_t warned = 0;
  std::uint64_t faulty = 0;         ///< records that the box reports as faulty: in no sum
  std::uint64_t implausible = 0;    ///< how often the numbers jumped or restarted too often (RdtContinuity)
  std::int64_t newest_good_ns = 0;  ///< arrival, monotonic clock
  std::int64_t newest_ns = 0;       ///< arrival of the newest record, usable or not
  /// Capture times of the good records, from their numbers at the box's rate; sums are relative to
  /// `base_ns`.
  std::int64_t base_ns = 0;
  std::uint64_t sum_since_base_ns = 0;
  std::int64_t newest_instant_ns = 0;  ///< of the newest good one
  SixAxes<double> bias_counts{};       ///< to be subtracted from a mean
  std::uint32_t bias_serial = 0;       ///< of the zero given by bias_counts
  double newtons_per_count = 0.0;
  double newton_millimetres_per_count = 0.0;
};

/// Counters for reports. Written by the receiving thread, read by any.
struct RdtCounters {
  std::atomic<std::uint64_t> good{0};
  std::atomic<std::uint64_t> gaps{0};
  std::atomic<std::uint64_t> lost{0};
  std::atomic<std::uint64_t> duplicates{0};
  std::atomic<std::uint64_t> old{0};          ///< overtaken by newer ones
  std::atomic<std::uint64_t> unconfirmed{0};  ///< far out of order
  std::atomic<std::uint64_t> box_restarts{0};
  std::atomic<std::uint64_t> stream_restarts{0};  ///< numbers began again since we asked for the stream again
  std::atomic<std::uint64_t> implausible{0};      ///< see RdtTotals
  std::atomic<std::int64_t> last_implausible_ns{0};
  std::atomic<std::uint64_t> malformed{0};  ///< datagrams that are not a whole number of records
  std::atomic<std::uint64_t> foreign{0};    ///< datagrams from someone else
  std::atomic<std::uint64_t> saturated{0};
  std::atomic<std::uint64_t> warned{0};
  std::atomic<std::uint64_t> faulty{0};
  std::atomic<std::uint64_t> silences{0};
  std::atomic<std::uint64_t> requests{0};  ///< for the stream, including the first
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
  double rate_hz = 0.0;           ///< records a second, as set in the box; 0 = unknown
  SixAxes<double> bias_counts{};  ///< of an earlier bias that is still valid
  std::uint32_t bias_serial = 0;
  SixAxes<double> range_counts{};  ///< a reading that reaches this is at its end of range
  std::chrono::nanoseconds stale_after{};
  std::chrono::nanoseconds retry_first{};
  std::chrono::nanoseconds retry_longest{};
  int fifo_priority = 0;
  Callback<void()> on_box_restart;  ///< called on the receiving thread; must not wait
};

/// The stream of records from a box: with its own socket and thread: asks for the stream, receives, sorts out
/// and totals up; asks again, ever less often, while nothing comes. Asking again also wins the stream back
/// from another client: a box serves the client that asked last, and does not inform the others.
class RdtStream {
 public:
  RdtStream(hal::LatestValue<RdtTotals>& to_tick, RdtCounters& counters);
  ~RdtStream();
  RdtStream(const RdtStream&) = delete;
  RdtStream& operator=(const RdtStream&) = delete;

  /// Opens the socket, starts the thread, requests the stream. Only while stopped.
  std::optional<hal::Error> start(const RdtStreamSettings& settings);
  /// Commands the box to stop, ends the thread, closes the socket.
  void stop() noexcept;

  // While started, not on the receiving thread:
  RdtTotals totals();
  /// Makes a reading of `bias_counts` zero from now on; the serial number changes with the first sample that
  /// uses it.
  void set_bias(const SixAxes<double>& bias_counts, std::uint32_t serial);
  /// Changes only the serial number, after the zero was lost.
  void set_bias_serial(std::uint32_t serial);
  void send(RdtCommand command);

  /// A refused system request (priority), with its remedy; empty if all were granted.
  const std::string& shortcoming() const noexcept { return shortcoming_; }

 private:
  class Receiver;
  hal::LatestValue<RdtTotals>& to_tick_;
  RdtCounters& counters_;
  std::uint32_t session_ = 0;
  std::string shortcoming_;
  std::unique_ptr<Receiver> receiver_;
};

using hal::monotonic_ns;  ///< of arrival times

}  // namespace hapticd::netft
