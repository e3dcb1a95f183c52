#include "hal/daq/comedi_acquisition.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>

namespace hapticd::daq {

namespace {

using std::chrono::milliseconds;

constexpr std::size_t kRingScans = 2048;  // 0.2 s at 10 kHz
constexpr std::size_t kScansARead = 512;
constexpr milliseconds kMinPause{100};
constexpr milliseconds kMaxPause{5000};
constexpr int kPollMs = 20;
constexpr std::int64_t kStallNs = 500'000'000;
constexpr double kRateTolerance = 0.01;
constexpr unsigned kNsPerS = 1'000'000'000;

std::int64_t steady_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

unsigned reference_of(InputReference reference) {
  switch (reference) {
    case InputReference::kGround:
      return AREF_GROUND;
    case InputReference::kCommon:
      return AREF_COMMON;
    default:
      return AREF_DIFF;
  }
}

}  // namespace

ComediAcquisition::ComediAcquisition(const BoardConfig& config) : config_(config), ring_(kRingScans) {}

ComediAcquisition::~ComediAcquisition() {
  stop();
}

std::optional<hal::Error> ComediAcquisition::start() {
  stop();
  auto stream = open_stream();
  if (!stream) return stream.error();
  std::array<Scan, 1> none{};
  std::size_t dropped = 0;
  ring_.take(none, dropped);  // remains of an earlier engagement
  newest_ns_.store(0, std::memory_order_relaxed);
  overrun_.store(false, std::memory_order_relaxed);
  {
    const MutexLock lock(mutex_);
    stopping_ = false;
  }
  adopt(*stream);
  thread_ = std::thread([this, started = std::move(*stream)]() mutable { run(std::move(started)); });
  return std::nullopt;
}

void ComediAcquisition::stop() noexcept {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
  running_.store(false, std::memory_order_release);
}

hal::Result<ComediAcquisition::Stream> ComediAcquisition::open_stream() const {
  const ComediConfig& comedi = config_.comedi;
  auto opened = open_comedi(comedi.device);
  if (!opened) return opened.error();
  Stream stream;
  stream.device = std::move(*opened);
  comedi_t* const device = stream.device.get();

  int subdevice = comedi.input_subdevice;
  if (subdevice < 0) subdevice = comedi_get_read_subdevice(device);
  std::vector<double> wanted(comedi.input_channels.begin(), comedi.input_channels.end());
  wanted.insert(wanted.end(), config_.spare_channels.begin(), config_.spare_channels.end());
  for (const double channel : wanted) {
    auto found = find_analog(device, comedi,
                             {.subdevice = subdevice,
                              .channel = channel,
                              .low_v = comedi.input_low_v,
                              .high_v = comedi.input_high_v,
                              .reference = reference_of(comedi.input_reference)});
    if (!found) return found.error();
    stream.channels.push_back(*found);
    stream.channel_list.push_back(CR_PACK(found->channel, found->range, found->reference));
  }
  const unsigned where = stream.channels.front().subdevice;
  if (comedi_get_read_subdevice(device) != static_cast<int>(where) &&
      comedi_set_read_subdevice(device, where) < 0) {
    return comedi_error(comedi.device, fmt::format("subdevice {} cannot stream", where),
                        "use the default read subdevice of comedi_board_info");
  }
  const int flags = comedi_get_subdevice_flags(device, where);
  stream.wide = flags >= 0 && (static_cast<unsigned>(flags) & SDF_LSAMPL) != 0;

  comedi_cmd command{};
  const auto count = static_cast<unsigned>(stream.channels.size());
  const auto period_ns = static_cast<unsigned>(std::lround(kNsPerS / config_.scan_rate_hz));
  if (comedi_get_cmd_generic_timed(device, where, &command, count, period_ns) < 0) {
    return comedi_error(comedi.device, "the board cannot scan its inputs with a hardware clock",
                        "use a board with a streaming analog input");
  }
  command.chanlist = stream.channel_list.data();
  command.chanlist_len = count;
  command.scan_end_arg = count;
  command.stop_src = TRIG_NONE;
  command.stop_arg = 0;
  command.flags |= CMDF_WAKE_EOS;  // deliver each scan at once: its age is part of the loop's delay
  // The driver corrects arguments it cannot honour, one kind per pass.
  int verdict = 0;
  for (int pass = 0; pass < 5; ++pass) {
    verdict = comedi_command_test(device, &command);
    if (verdict <= 0) break;
  }
  const double actual_hz =
      command.scan_begin_src == TRIG_TIMER && command.scan_begin_arg > 0
          ? static_cast<double>(kNsPerS) / command.scan_begin_arg
          : static_cast<double>(kNsPerS) / (static_cast<double>(command.convert_arg) * count + 1e-9);
  if (verdict != 0) {
    return comedi_error(comedi.device, "the board refuses to scan the inputs as configured",
                        "check channels, range and reference (comedi_board_info -v)");
  }
  if (!(std::abs(actual_hz / config_.scan_rate_hz - 1.0) <= kRateTolerance)) {
    return hal::Error{
        "the board cannot scan at that rate", comedi.device, fmt::format("{} Hz", config_.scan_rate_hz),
        fmt::format("{:.1f} Hz is nearest", actual_hz), "set scan_rate_hz to what the board can do"};
  }
  if (comedi_command(device, &command) < 0) {
    return comedi_error(comedi.device, "cannot start the acquisition",
                        "check that no other program holds the board's analog inputs");
  }
  stream.file = comedi_fileno(device);
  const int file_flags = fcntl(stream.file, F_GETFL);
  if (file_flags < 0 || fcntl(stream.file, F_SETFL, file_flags | O_NONBLOCK) < 0) {
    return hal::Error{"cannot read the board without blocking", comedi.device, std::strerror(errno), "",
                      "check the comedi driver"};
  }
  return stream;
}

void ComediAcquisition::adopt(const Stream& stream) noexcept {
  low_v_.store(stream.channels.front().low_v, std::memory_order_relaxed);
  high_v_.store(stream.channels.front().high_v, std::memory_order_relaxed);
  bits_.store(bits_of(stream.channels.front().most), std::memory_order_relaxed);
  filled_ = 0;
  silent_since_ns_ = steady_ns();
  running_.store(true, std::memory_order_release);
}

void ComediAcquisition::run(Stream stream) noexcept {
  pthread_setname_np(pthread_self(), "acquisition");
  raise_priority();
  bytes_.assign(kScansARead * stream.channels.size() * sizeof(lsampl_t), 0);
  milliseconds back_off = kMinPause;
  bool has_delivered = false;  // since the stream was started last
  for (;;) {
    if (!pause(milliseconds::zero())) break;
    const Outcome outcome = take(stream);
    if (outcome == Outcome::kDelivered) {
      back_off = kMinPause;
      has_delivered = true;
    }
    if (outcome == Outcome::kDelivered || outcome == Outcome::kSilent) continue;
    if (outcome == Outcome::kOverrun) {
      overruns_.fetch_add(1, std::memory_order_relaxed);
      overrun_.store(true, std::memory_order_release);
    } else {
      running_.store(false, std::memory_order_release);
    }
    comedi_cancel(stream.device.get(), stream.channels.front().subdevice);
    stream = {};
    // An overrun is fixed at once, so that the tick sees a gap rather than a loss; not when it is all there
    // is.
    bool go_on = (outcome == Outcome::kOverrun && has_delivered) || pause(back_off);
    has_delivered = false;
    while (go_on) {
      auto again = open_stream();
      if (again) {
        stream = std::move(*again);
        restarts_.fetch_add(1, std::memory_order_relaxed);
        adopt(stream);
        break;
      }
      running_.store(false, std::memory_order_release);
      back_off = std::min(back_off * 2, kMaxPause);
      go_on = pause(back_off);
    }
    if (!go_on) break;
  }
  if (stream.device) comedi_cancel(stream.device.get(), stream.channels.front().subdevice);
}

ComediAcquisition::Outcome ComediAcquisition::take(Stream& stream) noexcept {
  pollfd waiting{stream.file, POLLIN, 0};
  const int ready = poll(&waiting, 1, kPollMs);
  const std::int64_t now_ns = steady_ns();
  if (ready == 0) return now_ns - silent_since_ns_ > kStallNs ? Outcome::kEnded : Outcome::kSilent;
  if (ready < 0) return errno == EINTR ? Outcome::kSilent : Outcome::kEnded;
  const ssize_t got = ::read(stream.file, bytes_.data() + filled_, bytes_.size() - filled_);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) {
      return now_ns - silent_since_ns_ > kStallNs ? Outcome::kEnded : Outcome::kSilent;
    }
    return errno == EPIPE ? Outcome::kOverrun : Outcome::kEnded;
  }
  if (got == 0) return Outcome::kEnded;
  silent_since_ns_ = now_ns;
  filled_ += static_cast<std::size_t>(got);
  const std::size_t scan_bytes = stream.channels.size() * (stream.wide ? sizeof(lsampl_t) : sizeof(sampl_t));
  const std::size_t scans = filled_ / scan_bytes;
  convert(stream, scans, now_ns);
  std::memmove(bytes_.data(), bytes_.data() + scans * scan_bytes, filled_ - scans * scan_bytes);
  filled_ -= scans * scan_bytes;
  return Outcome::kDelivered;
}

void ComediAcquisition::convert(const Stream& stream, std::size_t scans, std::int64_t now_ns) noexcept {
  const double period_ns = static_cast<double>(kNsPerS) / config_.scan_rate_hz;
  const unsigned char* at = bytes_.data();
  for (std::size_t k = 0; k < scans; ++k) {
    Scan scan;
    scan.time_ns = now_ns - std::llround(static_cast<double>(scans - 1 - k) * period_ns);
    for (std::size_t j = 0; j < stream.channels.size(); ++j) {
      lsampl_t count = 0;
      if (stream.wide) {
        std::memcpy(&count, at, sizeof(lsampl_t));
        at += sizeof(lsampl_t);
      } else {
        sampl_t narrow = 0;
        std::memcpy(&narrow, at, sizeof(sampl_t));
        at += sizeof(sampl_t);
        count = narrow;
      }
      scan.volts[j] = comedi_to_physical(count, &stream.channels[j].converter);
    }
    if (!ring_.push(scan)) unread_.fetch_add(1, std::memory_order_relaxed);
  }
  if (scans == 0) return;
  scans_.fetch_add(scans, std::memory_order_relaxed);
  newest_ns_.store(now_ns, std::memory_order_release);
}

ScanReading ComediAcquisition::read(std::span<Scan> scans) noexcept {
  ScanReading reading;
  reading.running = running_.load(std::memory_order_acquire);
  reading.overrun = overrun_.exchange(false, std::memory_order_acq_rel);
  std::size_t dropped = 0;
  reading.count = ring_.take(scans, dropped);
  if (dropped > 0) unread_.fetch_add(dropped, std::memory_order_relaxed);
  reading.newest_ns = newest_ns_.load(std::memory_order_acquire);
  return reading;
}

bool ComediAcquisition::pause(milliseconds time) noexcept {
  MutexLock lock(mutex_);
  const auto until = std::chrono::steady_clock::now() + time;
  while (!stopping_ && time > milliseconds::zero() && stopped_.wait_until(mutex_, until)) {
  }
  return !stopping_;
}

void ComediAcquisition::raise_priority() noexcept {
  if (config_.comedi.fifo_priority <= 0) return;
  sched_param parameter{};
  parameter.sched_priority = config_.comedi.fifo_priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  priority_refused_.store(refused != 0, std::memory_order_relaxed);
}

void ComediAcquisition::describe(hal::PartReport& report) const {
  const auto figure = [&](const char* name, const std::atomic<std::uint64_t>& counter) {
    report.figures.push_back({name, static_cast<double>(counter.load(std::memory_order_relaxed)), ""});
  };
  figure("board_scans", scans_);
  figure("board_scans_unread", unread_);
  figure("board_overruns", overruns_);
  figure("board_restarts", restarts_);
  if (priority_refused_.load(std::memory_order_relaxed)) {
    report.findings.emplace_back(
        "the acquisition's thread may not have its real-time priority; allow it with RLIMIT_RTPRIO");
  }
}

}  // namespace hapticd::daq
