#include "server/recording/recording_run.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "hal/recording/recording_names.h"
#include "server/process/log.h"
#include "server/process/thread_start.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kRunPoll{50};
constexpr std::chrono::seconds kEndTime{1};
constexpr std::chrono::seconds kAnchorTime{60};
constexpr std::uint32_t kTakenAtOnce = 2048;
/// Step of a clock that counts: within a second, a clock that is only steered changes by half a millisecond.
constexpr std::int64_t kClockStepNs = 20'000'000;
/// Much is written at once only if the disk stalled.
constexpr std::size_t kMaxGathered = std::size_t{8} << 20U;

SubscriptionOptions subscription_options(const RecordingSources& sources, const RunOptions& options) {
  SubscriptionOptions subscription;
  subscription.decimation = options.decimation;
  subscription.batch_size = kTakenAtOnce;
  subscription.is_own = true;
  subscription.longest_wait = std::chrono::milliseconds(0);
  const double samples = RecordingRun::kQueueS * sources.rate_hz / options.decimation;
  subscription.queue_samples = static_cast<std::uint32_t>(std::max(1000.0, samples));
  return subscription;
}

}  // namespace

Refusal cannot_record(hal::Error error) {
  const bool is_full = error.code == hal::ErrorCode::kFull;
  return {is_full ? RefusalKind::kResourceExhausted : RefusalKind::kFailedPrecondition, std::move(error),
          is_full ? Reason::kDiskFull : Reason::kOfKind};
}

Outcome<std::unique_ptr<RecordingRun>> RecordingRun::start(TelemetryHub& hub, EventLog& event_log,
                                                           const RecordingSources& sources,
                                                           RunOptions options) {
  const ColumnTable table(sources.columns, options.channels);
  auto output =
      RecordingOutput::begin(options.path, table.columns(), sources, anchor_of(sources), options.start);
  if (!output) return cannot_record(output.error());
  const std::string path = options.path;
  std::unique_ptr<RecordingRun> run(
      new RecordingRun(hub, event_log, sources, std::move(options), std::move(*output)));
  if (auto error = run->begin()) {
    run.reset();
    std::error_code ignored;
    std::filesystem::remove(path, ignored);  // it holds nothing yet
    return Refusal{RefusalKind::kResourceExhausted, std::move(*error)};
  }
  return run;
}

RecordingRun::RecordingRun(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources,
                           RunOptions options, RecordingOutput output)
    : hub_(hub),
      event_log_(event_log),
      sources_(sources),
      options_(std::move(options)),
      table_(sources.columns, options_.channels),
      subscription_(hub.subscribe(subscription_options(sources, options_))),
      output_(std::move(output)),
      event_number_(event_log.last()) {
  const ClockReading now = sources_.clocks();
  utc_offset_ns_ = now.utc_ns - now.monotonic_ns;
  report_.bytes = output_.bytes();
}

std::optional<hal::Error> RecordingRun::begin() {
  // The one that writes is the last: nothing is written if there is no other.
  auto error = start_thread(sync_thread_, [this] { run_sync(); });
  if (!error) error = start_thread(thread_, [this] { run(); });
  if (error) hub_.unsubscribe(subscription_);
  return error;
}

RecordingRun::~RecordingRun() {
  end("the daemon ended");
}

void RecordingRun::end(const std::string& reason) {
  {
    const MutexLock lock(mutex_);
    if (!std::exchange(ending_, true)) wanted_reason_ = reason;
  }
  signal_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (sync_thread_.joinable()) sync_thread_.join();
}

RunReport RecordingRun::report() const {
  const MutexLock lock(mutex_);
  return report_;
}

void RecordingRun::run() {
  pthread_setname_np(pthread_self(), "record");
  chunk_due_ = Clock::now() + kChunkTime;
  end_due_ = Clock::now() + kEndTime;
  anchor_due_ = Clock::now() + kAnchorTime;
  std::optional<hal::Error> error;
  MutexLock lock(mutex_);
  while (!ending_ && !error) {
    signal_.wait_for(mutex_, kRunPoll);
    error = sync_error_;
    lock.unlock();
    take_records();
    take_events();
    if (!error) error = write_due(Clock::now());
    publish(std::nullopt, "");
    lock.lock();
  }
  lock.unlock();
  if (!error) {
    hub_.flush();
    take_records();
    take_events();
  }
  hub_.unsubscribe(subscription_);
  finish(error);
}

void RecordingRun::take_records() {
  Subscription::Batch batch;
  while (subscription_->take(batch, Clock::now())) {
    for (const Subscription::Entry& entry : batch.entries) {
      const rt::TickRecord& record = entry.record();
      if (last_tick_ && record.tick > *last_tick_ + options_.decimation) note_loss(record);
      if (!last_tick_) first_time_ns_ = record.time_ns;
      last_tick_ = record.tick;
      last_time_ns_ = record.time_ns;
      for (WatchedEvent& watched : watch_.look(record)) {
        recording::Event& event = watched.event;
        if (event.kind == recording::EventKind::kScene) scene_changed_ = true;
        event.unix_ns = output_.anchor().unix_at(event.time_ns);
        add_event(std::move(event));
      }
      table_.append_row(record, rows_);
    }
    flush_rows();
  }
}

void RecordingRun::note_loss(const rt::TickRecord& next) {
  const std::uint64_t lost = (next.tick - *last_tick_) / options_.decimation - 1;
  lost_ticks_ += lost;
  recording::Event event;
  event.time_ns = last_time_ns_;
  event.tick = *last_tick_;
  event.unix_ns = output_.anchor().unix_at(last_time_ns_);
  event.kind = recording::EventKind::kLoss;
  event.lost_ticks = lost;
  event.text = fmt::format("{} ticks are missing between {} and {}", lost, *last_tick_, next.tick);
  flush_rows();
  add_event(std::move(event));
}

void RecordingRun::flush_rows() {
  output_.add_rows(rows_);
  rows_.clear();
}

void RecordingRun::add_event(recording::Event event) {
  output_.add_event(event);
}

void RecordingRun::take_events() {
  const std::uint64_t missed_before = missed_events_;
  for (recording::Event& event : event_log_.after(event_number_, missed_events_)) {
    if (event.kind == recording::EventKind::kScene) scene_changed_ = true;
    add_event(std::move(event));
  }
  if (missed_events_ == missed_before) return;
  recording::Event event;
  event.time_ns = last_time_ns_;
  event.tick = last_tick_.value_or(0);
  event.unix_ns = output_.anchor().unix_at(last_time_ns_);
  event.kind = recording::EventKind::kLoss;
  event.text =
      fmt::format("{} events are missing: there were too many at once", missed_events_ - missed_before);
  add_event(std::move(event));
}

std::optional<hal::Error> RecordingRun::write_due(Clock::time_point now) {
  if (scene_changed_) {
    scene_changed_ = false;
    if (auto error = output_.add_metadata(recording::kSceneMetadata, sources_.scene())) return error;
  }
  if (now >= chunk_due_ || output_.gathered_bytes() > kMaxGathered) {
    chunk_due_ = now + kChunkTime;
    if (auto error = output_.close_chunk()) return error;
  }
  if (now >= anchor_due_) {
    anchor_due_ = now + kAnchorTime;
    if (auto error = output_.add_metadata(recording::kAnchorMetadata, texts_of(anchor_of(sources_))))
      return error;
  }
  if (now < end_due_) return std::nullopt;
  end_due_ = now + kEndTime;
  note_clock();
  return options_.must_end();
}

void RecordingRun::note_clock() {
  const ClockReading now = sources_.clocks();
  const std::int64_t offset_ns = now.utc_ns - now.monotonic_ns;
  const std::int64_t set_ns = offset_ns - std::exchange(utc_offset_ns_, offset_ns);
  if (std::abs(set_ns) < kClockStepNs) return;
  recording::Event event;
  event.time_ns = last_time_ns_;
  event.tick = last_tick_.value_or(0);
  event.unix_ns = output_.anchor().unix_at(last_time_ns_);
  event.kind = recording::EventKind::kDaemon;
  event.text = fmt::format("the machine's clock was set {} by {:.3f} s; times in this file go on as before",
                           set_ns < 0 ? "back" : "forward", 1e-9 * static_cast<double>(std::abs(set_ns)));
  add_event(std::move(event));
}

void RecordingRun::publish(const std::optional<hal::Error>& error, const std::string& reason) {
  const MutexLock lock(mutex_);
  report_.rows = output_.rows();
  report_.lost_ticks = lost_ticks_;
  report_.bytes = output_.bytes();
  report_.duration_s = last_tick_ ? 1e-9 * static_cast<double>(last_time_ns_ - first_time_ns_) : 0.0;
  report_.error = error;
  report_.end_reason = reason;
}

void RecordingRun::finish(const std::optional<hal::Error>& error) {
  std::string reason;
  {
    const MutexLock lock(mutex_);
    ending_ = true;
    reason = error ? error->text() : wanted_reason_;
  }
  signal_.notify_all();
  recording::Event event;
  event.time_ns = last_time_ns_;
  event.tick = last_tick_.value_or(0);
  event.unix_ns = output_.anchor().unix_at(last_time_ns_);
  event.kind = recording::EventKind::kEnd;
  event.text = reason;
  output_.add_event(event);
  // A disk that is full has no room for these; the end is written all the same.
  if (scene_changed_) static_cast<void>(output_.add_metadata(recording::kSceneMetadata, sources_.scene()));
  static_cast<void>(output_.add_metadata(recording::kAnchorMetadata, texts_of(anchor_of(sources_))));
  static_cast<void>(output_.close_chunk());
  const auto unfinished = output_.finish({{"reason", reason}, {"lost_ticks", std::to_string(lost_ticks_)}});
  if (error) log_warning("recording '" + options_.id + "' ended: " + reason);
  if (unfinished) {
    log_warning("recording '" + options_.id +
                "' has no end (it is repaired at the next start): " + unfinished->text());
  }
  if (error) event_log_.add(event);
  publish(error, reason);
  const MutexLock lock(mutex_);
  report_.is_running = false;
}

void RecordingRun::run_sync() {
  pthread_setname_np(pthread_self(), "record-sync");
  std::uint64_t synced = 0;
  MutexLock lock(mutex_);
  while (!ending_) {
    const auto due = Clock::now() + kSyncTime;
    while (!ending_ && signal_.wait_until(mutex_, due)) {
    }
    const std::uint64_t bytes = report_.bytes;
    if (bytes == synced || ending_) continue;
    lock.unlock();
    const auto began = Clock::now();
    const auto error = output_.sync();
    const double took_s = std::chrono::duration<double>(Clock::now() - began).count();
    lock.lock();
    synced = bytes;
    sync_error_ = error;
    report_.longest_sync_s = std::max(report_.longest_sync_s, took_s);
  }
}

}  // namespace hapticd::server
