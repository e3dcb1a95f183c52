#include "hal/netft/rdt_stream.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "hal/netft/rdt_receiver.h"
#include "hal/netft/rdt_status.h"

namespace hapticd::netft {

namespace {

using boost::asio::ip::udp;

constexpr std::int64_t kSecondNs = 1'000'000'000;
/// The default of 212 kB holds 277 datagrams of this size, 40 ms at 7 kHz: less than the stalls of an
/// ordinary machine.
constexpr int kReceiveBufferBytes = 4 << 20;
/// Numbers that begin again so soon after a request are put down to it.
constexpr std::int64_t kRequestEffectNs = 5 * kSecondNs;

}  // namespace

std::optional<hal::Error> RdtStream::Receiver::open() {
  boost::system::error_code code;
  const boost::asio::ip::address address = boost::asio::ip::make_address(settings_.address, code);
  box_ = udp::endpoint(address, static_cast<std::uint16_t>(settings_.port));
  if (!code) socket_.open(box_.protocol(), code);
  if (!code) socket_.bind(udp::endpoint(box_.protocol(), 0), code);
  if (!code) socket_.non_blocking(true, code);
  if (code) {
    return hal::Error{.what = "no UDP socket could be opened: " + code.message(),
                      .where = "udp " + settings_.address + ":" + std::to_string(settings_.port),
                      .value = {},
                      .limit = {},
                      .remedy = "check the address, and the limits of the system on open files"};
  }
  // The kernel may allow less; too small a buffer shows as gaps.
  boost::system::error_code ignored;
  socket_.set_option(boost::asio::socket_base::receive_buffer_size(kReceiveBufferBytes), ignored);
  return std::nullopt;
}

std::string RdtStream::Receiver::run(int fifo_priority) {
  second_begin_ns_ = monotonic_ns();
  request_stream();
  receive();
  supervise();
  thread_ = std::thread([this] {
    for (bool done = false; !done;) {
      try {
        context_.run();
        done = true;
      } catch (const std::exception&) {  // out of memory: the next step is tried later
        count(counters_.exceptions);
      }
    }
  });
  pthread_setname_np(thread_.native_handle(), "hapticd-netft");
  if (fifo_priority == 0) return {};
  sched_param parameter{};
  parameter.sched_priority = fifo_priority;
  const int failure = pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &parameter);
  if (failure == 0) return {};
  return "the receiving thread has no SCHED_FIFO priority " + std::to_string(fifo_priority) + ": " +
         std::strerror(failure) +
         "; grant it with 'setcap cap_sys_nice,cap_ipc_lock+ep' on the binary, or set fifo_priority = 0";
}

void RdtStream::Receiver::stop() noexcept {
  boost::asio::post(context_, [this] {
    send(RdtCommand::kStop);
    boost::system::error_code ignored;
    socket_.close(ignored);
    timer_.cancel();
    stopped_ = true;
  });
  thread_.join();
}

void RdtStream::Receiver::request_stream() noexcept {
  count(counters_.requests);
  continuity_.note_request();
  last_request_ns_ = monotonic_ns();
  retry_wait_ns_ =
      std::min(std::max(2 * retry_wait_ns_, settings_.retry_first.count()), settings_.retry_longest.count());
  next_retry_ns_ = last_request_ns_ + retry_wait_ns_;
  send(RdtCommand::kStartRealTime);
}

void RdtStream::Receiver::receive() {
  // False until the wait has begun: it may throw if memory is short, and supervise() then begins it again.
  receiving_ = false;
  socket_.async_receive_from(boost::asio::buffer(buffer_), sender_,
                             [this](const boost::system::error_code& code, std::size_t length) {
                               if (stopped_) return;
                               receiving_ = !code;
                               if (code) return;  // supervise() begins again: no error may spin here
                               take_datagram(length);
                               receive();
                             });
  receiving_ = true;
}

void RdtStream::Receiver::take_datagram(std::size_t length) noexcept {
  if (sender_ != box_) {
    count(counters_.foreign);
    return;
  }
  const std::size_t records = parse_rdt_datagram({buffer_.data(), length}, records_);
  if (records == 0) {
    count(counters_.malformed);
    return;
  }
  const std::int64_t now_ns = monotonic_ns();
  if (totals_.newest_ns != 0 && now_ns - totals_.newest_ns > settings_.stale_after.count()) {
    after_silence_ = true;
    clock_.restart();
  }
  for (std::size_t i = 0; i < records; ++i) take_record(records_[i], now_ns);
  to_tick_.publish(totals_);
}

void RdtStream::Receiver::take_record(const RdtRecord& record, std::int64_t now_ns) noexcept {
  const RdtOrderVerdict verdict = sequence_.judge(record.rdt_sequence, after_silence_);
  switch (verdict.order) {
    case RdtOrder::kDuplicate:
      count(counters_.duplicates);
      return;
    case RdtOrder::kOld:
      count(counters_.old);
      return;
    case RdtOrder::kUnconfirmed:
      count(counters_.unconfirmed);
      return;
    case RdtOrder::kRestart:
      note_restart(record, now_ns);
      break;
    case RdtOrder::kInOrder:
      if (verdict.begins) clock_.restart();
      // A box that restarted soon after its start may by chance continue with the right number.
      if (after_silence_ && !counts_on(record)) note_restart(record, now_ns);
      if (verdict.lost > 0) {
        count(counters_.gaps);
        count(counters_.lost, verdict.lost);
        second_lost_ += verdict.lost;
      }
      break;
  }
  after_silence_ = false;
  newest_ft_sequence_ = record.ft_sequence;
  const std::int64_t instant_ns = clock_.instant_ns(record.rdt_sequence, now_ns);
  if (clock_.ahead_ns() > 0.0 && continuity_.note_ahead(clock_.ahead_ns(), now_ns)) note_implausible(now_ns);
  totals_.newest_ns = now_ns;
  counters_.silent.store(false, std::memory_order_relaxed);
  ++second_records_;
  second_status_ |= record.status;
  if ((record.status & ~counters_.recent_status.load(std::memory_order_relaxed)) != 0) {
    counters_.recent_status.store(second_status_ | earlier_status_, std::memory_order_relaxed);
  }
  use(record, now_ns, instant_ns);
}

void RdtStream::Receiver::note_restart(const RdtRecord& record, std::int64_t now_ns) noexcept {
  clock_.restart();
  if (continuity_.note_restart(now_ns)) note_implausible(now_ns);
  const bool asked_for = now_ns - last_request_ns_ < kRequestEffectNs;
  if (counts_on(record) && asked_for) {
    count(counters_.stream_restarts);
    return;
  }
  count(counters_.box_restarts);
  if (settings_.on_box_restart) settings_.on_box_restart();
}

void RdtStream::Receiver::use(const RdtRecord& record, std::int64_t now_ns,
                              std::int64_t instant_ns) noexcept {
  const RdtFitness fitness = judge_rdt_status(record.status);
  if (fitness.warning) {
    ++totals_.warned;
    count(counters_.warned);
  }
  SixAxes<std::int32_t> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    counts[i] = record.force_counts[i];
    counts[i + 3] = record.torque_counts[i];
  }
  bool saturated = fitness.saturated;
  bool meaningless = false;  // the limit of the number type, not of the range
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const bool at_end = counts[i] == std::numeric_limits<std::int32_t>::min() ||
                        counts[i] == std::numeric_limits<std::int32_t>::max();
    meaningless = meaningless || at_end;
    saturated = saturated || at_end || std::abs(static_cast<double>(counts[i])) >= settings_.range_counts[i];
  }
  if (saturated) {
    ++totals_.saturated;
    count(counters_.saturated);
  }
  if (fitness.faulty) {
    ++totals_.faulty;
    count(counters_.faulty);
  }
  if (fitness.faulty || meaningless) return;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    totals_.sum_counts[i] += static_cast<std::uint64_t>(static_cast<std::int64_t>(counts[i]));
  }
  totals_.newest_counts = counts;
  totals_.newest_good_ns = now_ns;
  totals_.newest_instant_ns = instant_ns;
  totals_.sum_since_base_ns += static_cast<std::uint64_t>(instant_ns - totals_.base_ns);
  ++totals_.good;
  count(counters_.good);
}

void RdtStream::Receiver::supervise() {
  const auto period =
      std::clamp<std::chrono::nanoseconds>(std::min(settings_.stale_after, settings_.retry_first) / 2,
                                           std::chrono::milliseconds(2), std::chrono::milliseconds(50));
  timer_.expires_after(period);
  timer_.async_wait([this](const boost::system::error_code&) {
    if (stopped_) return;
    if (!receiving_) receive();
    check_silence(monotonic_ns());
    supervise();
  });
}

void RdtStream::Receiver::check_silence(std::int64_t now_ns) noexcept {
  const bool heard = totals_.newest_ns != 0;
  const bool silent = !heard || now_ns - totals_.newest_ns > settings_.stale_after.count();
  const bool was_silent = counters_.silent.load(std::memory_order_relaxed);
  counters_.silent.store(silent, std::memory_order_relaxed);
  if (silent) {
    if (heard && !was_silent) {
      count(counters_.silences);
      next_retry_ns_ = now_ns;
      retry_wait_ns_ = 0;
    }
    if (heard) counters_.last_silence_ns.store(now_ns, std::memory_order_relaxed);
    if (now_ns >= next_retry_ns_) request_stream();
  } else {
    retry_wait_ns_ = 0;
  }
  if (now_ns - second_begin_ns_ >= kSecondNs) end_second(now_ns);
}

void RdtStream::Receiver::end_second(std::int64_t now_ns) noexcept {
  const auto records = static_cast<double>(second_records_);
  const auto lost = static_cast<double>(second_lost_);
  counters_.rate_hz.store(1e9 * records / static_cast<double>(now_ns - second_begin_ns_),
                          std::memory_order_relaxed);
  counters_.loss_share.store(lost > 0.0 ? lost / (records + lost) : 0.0, std::memory_order_relaxed);
  earlier_status_ = second_status_;
  counters_.recent_status.store(earlier_status_, std::memory_order_relaxed);
  second_status_ = 0;
  second_records_ = 0;
  second_lost_ = 0;
  second_begin_ns_ = now_ns;
}

RdtStream::RdtStream(hal::LatestValue<RdtTotals>& to_tick, RdtCounters& counters)
    : to_tick_(to_tick), counters_(counters) {}

RdtStream::~RdtStream() {
  stop();
}

std::optional<hal::Error> RdtStream::start(const RdtStreamSettings& settings) {
  auto receiver = std::make_unique<Receiver>(settings, ++session_, to_tick_, counters_);
  if (auto error = receiver->open()) return error;
  counters_.silent.store(false, std::memory_order_relaxed);
  counters_.recent_status.store(0, std::memory_order_relaxed);
  counters_.rate_hz.store(0.0, std::memory_order_relaxed);
  counters_.loss_share.store(0.0, std::memory_order_relaxed);
  shortcoming_ = receiver->run(settings.fifo_priority);
  receiver_ = std::move(receiver);
  return std::nullopt;
}

void RdtStream::stop() noexcept {
  if (receiver_ == nullptr) return;
  receiver_->stop();
  receiver_.reset();
}

RdtTotals RdtStream::totals() {
  return receiver_->totals();
}

void RdtStream::set_bias(const SixAxes<double>& bias_counts, std::uint32_t serial) {
  receiver_->set_bias(bias_counts, serial);
}

void RdtStream::set_bias_serial(std::uint32_t serial) {
  receiver_->set_bias_serial(serial);
}

void RdtStream::send(RdtCommand command) {
  receiver_->command(command);
}

}  // namespace hapticd::netft
