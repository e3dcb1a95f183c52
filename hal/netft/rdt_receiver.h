#pragma once

#include <array>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <future>
#include <optional>
#include <string>
#include <thread>

#include "hal/netft/rdt_continuity.h"
#include "hal/netft/rdt_sequence.h"
#include "hal/netft/rdt_stream.h"
#include "hal/sample_clock.h"

namespace hapticd::netft {

inline void count(std::atomic<std::uint64_t>& counter, std::uint64_t by = 1) noexcept {
  counter.fetch_add(by, std::memory_order_relaxed);
}

/// Receives the box's datagrams on its own thread, and asks for the stream again when it stops.
class RdtStream::Receiver {
 public:
  Receiver(RdtStreamSettings settings, std::uint32_t session, hal::LatestValue<RdtTotals>& to_tick,
           RdtCounters& counters)
      : settings_(std::move(settings)),
        to_tick_(to_tick),
        counters_(counters),
        socket_(context_),
        timer_(context_),
        clock_(settings_.rate_hz) {
    totals_.base_ns = monotonic_ns();
    totals_.bias_counts = settings_.bias_counts;
    totals_.bias_serial = settings_.bias_serial;
    totals_.session = session;
    totals_.newtons_per_count = settings_.newtons_per_count;
    totals_.newton_millimetres_per_count = settings_.newton_millimetres_per_count;
  }

  std::optional<hal::Error> open();

  std::string run(int fifo_priority);

  void stop() noexcept;

  RdtTotals totals() {
    std::promise<RdtTotals> promise;
    boost::asio::post(context_, [&] { promise.set_value(totals_); });
    return promise.get_future().get();
  }

  void set_bias(const SixAxes<double>& bias_counts, std::uint32_t serial) {
    boost::asio::post(context_, [this, bias_counts, serial] {
      totals_.bias_counts = bias_counts;
      totals_.bias_serial = serial;
      to_tick_.publish(totals_);
    });
  }

  void set_bias_serial(std::uint32_t serial) {
    boost::asio::post(context_, [this, serial] {
      totals_.bias_serial = serial;
      to_tick_.publish(totals_);
    });
  }

  void command(RdtCommand command) {
    boost::asio::post(context_, [this, command] { send(command); });
  }

 private:
  void send(RdtCommand command) noexcept {
    const auto request = rdt_request(command);
    boost::system::error_code code;
    socket_.send_to(boost::asio::buffer(request), box_, 0, code);
    if (code) count(counters_.send_errors);
  }

  void request_stream() noexcept;

  void receive();

  void take_datagram(std::size_t length) noexcept;

  void take_record(const RdtRecord& record, std::int64_t now_ns) noexcept;

  void note_implausible(std::int64_t now_ns) noexcept {
    ++totals_.implausible;
    count(counters_.implausible);
    counters_.last_implausible_ns.store(now_ns, std::memory_order_relaxed);
  }

  /// True if the box's own count of measurements has not gone back.
  bool counts_on(const RdtRecord& record) const noexcept {
    return record.ft_sequence - newest_ft_sequence_ < 0x8000'0000U;
  }

  /// Notes a restart: a stream requested again may begin at 0 while the box's own count continues.
  void note_restart(const RdtRecord& record, std::int64_t now_ns) noexcept;

  void use(const RdtRecord& record, std::int64_t now_ns, std::int64_t instant_ns) noexcept;

  void supervise();

  void check_silence(std::int64_t now_ns) noexcept;

  void end_second(std::int64_t now_ns) noexcept;

  const RdtStreamSettings settings_;
  hal::LatestValue<RdtTotals>& to_tick_;
  RdtCounters& counters_;

  boost::asio::io_context context_{1};
  boost::asio::ip::udp::socket socket_;
  boost::asio::steady_timer timer_;
  boost::asio::ip::udp::endpoint box_;
  boost::asio::ip::udp::endpoint sender_;
  /// One byte more than the longest datagram, so that a longer one does not look like it.
  std::array<std::uint8_t, kRdtMostRecords * kRdtRecordBytes + 1> buffer_{};
  std::array<RdtRecord, kRdtMostRecords> records_{};
  std::thread thread_;
  bool stopped_ = false;
  bool receiving_ = false;

  RdtTotals totals_;
  RdtSequence sequence_;
  RdtContinuity continuity_;
  hal::SampleClock clock_;
  std::uint32_t newest_ft_sequence_ = 0;
  bool after_silence_ = false;
  std::int64_t last_request_ns_ = 0;
  std::int64_t next_retry_ns_ = 0;
  std::int64_t retry_wait_ns_ = 0;

  std::int64_t second_begin_ns_ = 0;
  std::uint64_t second_records_ = 0;
  std::uint64_t second_lost_ = 0;
  std::uint32_t second_status_ = 0;
  std::uint32_t earlier_status_ = 0;
};

}  // namespace hapticd::netft
