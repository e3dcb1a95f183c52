#include "server/telemetry/telemetry_hub.h"

#include <pthread.h>

#include <algorithm>

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kRound{2};
/// Records taken at once: limits a chunk's size when a recording is played as fast as possible.
constexpr std::size_t kMaxChunk = 1024;
/// Subscribers that keep up ask for the encoded form of a record within this time.
constexpr std::chrono::milliseconds kKeepsEncoded{250};
/// Age of a client's oldest sample, in ticks: one sample keeps all records of its chunk, also of those ticks
/// that a decimated stream leaves out. As many as the longest queue has.
constexpr std::uint64_t kMaxTicks = 60'000;

}  // namespace

void RecordChunk::append_encoded(std::string& text, std::uint32_t index, std::uint32_t channels,
                                 Encode encode) const {
  {
    const MutexLock lock(mutex_);
    if (const auto kept = encoded_.find(channels); kept != encoded_.end() && !kept->second[index].empty()) {
      text += kept->second[index];
      return;
    }
  }
  std::string made = encode(records[index], channels);
  text += made;
  const MutexLock lock(mutex_);
  if (is_old_ || (encoded_.size() >= kKeptSets && !encoded_.contains(channels))) return;
  std::vector<std::string>& texts = encoded_[channels];
  texts.resize(records.size());
  texts[index] = std::move(made);
}

void RecordChunk::forget_encoded() const {
  const MutexLock lock(mutex_);
  is_old_ = true;
  encoded_.clear();
}

bool Subscription::ready_locked(Clock::time_point now) const {
  if (queue_.empty()) return false;
  return closed_ || queue_.size() >= options_.batch_size ||
         now - queue_.front().chunk->received >= options_.longest_wait;
}

bool Subscription::ready(Clock::time_point now) const {
  const MutexLock lock(mutex_);
  return ready_locked(now) || closed_;
}

bool Subscription::take(Batch& batch, Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (!ready_locked(now)) return false;
  const std::size_t count = std::min<std::size_t>(queue_.size(), options_.batch_size);
  const auto end = queue_.begin() + static_cast<std::ptrdiff_t>(count);
  batch.entries.assign(std::make_move_iterator(queue_.begin()), std::make_move_iterator(end));
  queue_.erase(queue_.begin(), end);
  batch.dropped_by_subscriber = dropped_;
  batch.dropped_by_server = server_drops_;
  return true;
}

bool Subscription::ended() const {
  const MutexLock lock(mutex_);
  return closed_ && queue_.empty();
}

void Subscription::drop_oldest() {
  queue_.pop_front();
  ++dropped_;
}

void Subscription::offer(const std::shared_ptr<const RecordChunk>& chunk, std::size_t most) {
  const MutexLock lock(mutex_);
  const std::size_t held =
      options_.is_own ? options_.queue_samples : std::min<std::size_t>(options_.queue_samples, most);
  const std::uint64_t newest = chunk->records.back().tick;
  const auto is_too_old = [&](const Entry& one) {
    const bool is_many_ticks_old = !options_.is_own && newest - one.record().tick >= kMaxTicks;
    return is_many_ticks_old || chunk->received - one.chunk->received > kLongestQueued;
  };
  while (!queue_.empty() && is_too_old(queue_.front())) drop_oldest();
  // A chunk may be a moment older than the subscription.
  server_drops_ = std::max(chunk->dropped_by_server, server_drops_before_) - server_drops_before_;
  for (std::uint32_t i = 0; i < chunk->records.size(); ++i) {
    if (chunk->records[i].tick % options_.decimation != 0) continue;
    while (queue_.size() >= held) drop_oldest();
    queue_.push_back({chunk, i});
  }
}

void Subscription::close() {
  const MutexLock lock(mutex_);
  closed_ = true;
}

TelemetryHub::~TelemetryHub() {
  stop();
}

void TelemetryHub::start() {
  {
    const MutexLock lock(rounds_mutex_);
    mode_ = Mode::kRuns;
  }
  thread_ = std::thread([this] { run(); });
}

void TelemetryHub::stop() {
  {
    const MutexLock lock(rounds_mutex_);
    stop_requested_ = true;
  }
  round_wanted_.notify_all();
  if (thread_.joinable()) thread_.join();

  pump(Subscription::Clock::now());
  std::shared_ptr<const Subscribers> all;
  {
    const MutexLock lock(mutex_);
    closed_ = true;
    all = subscribers_;
  }
  for (const auto& subscriber : *all) {
    subscriber->close();
    if (subscriber->options_.on_ready) subscriber->options_.on_ready();
  }
}

void TelemetryHub::run() {
  pthread_setname_np(pthread_self(), "hapticd-fanout");
  MutexLock lock(rounds_mutex_);
  while (!stop_requested_) {
    const auto due = Subscription::Clock::now() + kRound;
    while (!is_wanted_ && !stop_requested_ && round_wanted_.wait_until(rounds_mutex_, due)) {
    }
    is_wanted_ = false;
    const std::uint64_t round = ++begun_;
    lock.unlock();
    pump(Subscription::Clock::now());
    lock.lock();
    done_ = round;
    round_done_.notify_all();
  }
  mode_ = Mode::kStopped;
  round_done_.notify_all();
}

void TelemetryHub::flush() {
  MutexLock lock(rounds_mutex_);
  if (mode_ == Mode::kByHand) {
    lock.unlock();
    return pump(Subscription::Clock::now());
  }
  const std::uint64_t round = begun_ + 1;  // the present one may have taken the ring's records before
  is_wanted_ = true;
  round_wanted_.notify_one();
  while (mode_ == Mode::kRuns && done_ < round) round_done_.wait(rounds_mutex_);
}

void TelemetryHub::pump(Subscription::Clock::time_point now) {
  for (; !recent_.empty() && now - recent_.front()->received > kKeepsEncoded; recent_.pop_front()) {
    recent_.front()->forget_encoded();
  }
  bool more = true;
  while (more) {
    auto chunk = std::make_shared<RecordChunk>();
    chunk->records.reserve(last_chunk_size_);
    rt::TickRecord record;
    while (chunk->records.size() < kMaxChunk && engine_.pop_record(record)) {
      record.angular_velocity_rad_per_s = turning_.follow(record.tip_orientation, record.time_ns);
      chunk->records.push_back(record);
    }
    more = chunk->records.size() == kMaxChunk;
    last_chunk_size_ = chunk->records.size();
    chunk->received = now;
    chunk->dropped_by_server = engine_.records_dropped();

    const auto all = subscribers();
    if (!chunk->records.empty()) {
      const std::shared_ptr<const RecordChunk> shared = std::move(chunk);
      const std::size_t most = Subscription::kMaxQueued / std::max<std::size_t>(all->size(), 1);
      for (const auto& subscriber : *all) subscriber->offer(shared, most);
      recent_.push_back(shared);
    }
    for (const auto& subscriber : *all) {
      if (subscriber->options_.on_ready && subscriber->ready(now)) subscriber->options_.on_ready();
    }
  }
}

std::shared_ptr<const TelemetryHub::Subscribers> TelemetryHub::subscribers() const {
  const MutexLock lock(mutex_);
  return subscribers_;
}

std::shared_ptr<Subscription> TelemetryHub::subscribe(SubscriptionOptions options) {
  flush();  // older records are not for this subscription
  auto subscription = std::make_shared<Subscription>(std::move(options), engine_.records_dropped());
  const MutexLock lock(mutex_);
  if (closed_) subscription->close();
  auto changed = std::make_shared<Subscribers>(*subscribers_);
  changed->push_back(subscription);
  subscribers_ = std::move(changed);
  return subscription;
}

void TelemetryHub::unsubscribe(const std::shared_ptr<Subscription>& subscription) {
  const MutexLock lock(mutex_);
  auto changed = std::make_shared<Subscribers>(*subscribers_);
  std::erase(*changed, subscription);
  subscribers_ = std::move(changed);
}

rt::TickRecord TelemetryHub::latest() {
  const MutexLock lock(latest_mutex_);
  return engine_.latest_record();
}

std::uint32_t TelemetryHub::subscriber_count() const {
  const auto all = subscribers();
  return static_cast<std::uint32_t>(
      std::count_if(all->begin(), all->end(), [](const auto& one) { return !one->options_.is_own; }));
}

}  // namespace hapticd::server
