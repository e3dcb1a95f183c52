#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "rt/loop/engine.h"
#include "rt/record/tick_record.h"
#include "server/telemetry/angular_velocity.h"

namespace hapticd::server {

/// What one subscriber asks for.
struct SubscriptionOptions {
  std::uint32_t decimation = 1;
  std::uint32_t batch_size = 20;
  std::uint32_t queue_samples = 4000;
  std::chrono::milliseconds longest_wait{100};  ///< a batch that is not full is ready when this old
  bool is_own = false;                          ///< of the daemon itself: not counted as a subscriber
  Callback<void()> on_ready;  ///< a batch is ready; called by the hub's thread, must not block
};

/// Records that were taken from the loop together; shared by all subscribers, never changed.
struct RecordChunk {
  std::vector<rt::TickRecord> records;
  std::chrono::steady_clock::time_point received;
  std::uint64_t dropped_by_server = 0;  ///< since the daemon started

  using Encode = std::string (*)(const rt::TickRecord& record, std::uint32_t channels);
  /// Appends the encoded form that `encode`, always the same one, makes of a record for the subscribers of
  /// these channels. It is kept for a while, so that it is made once for those who keep up, or a few times if
  /// some ask at the same time. Any thread.
  void append_encoded(std::string& text, std::uint32_t index, std::uint32_t channels, Encode encode) const;
  /// Keeps no encoded form from now on: what slow subscribers hold of the chunk are its records alone.
  void forget_encoded() const;

 private:
  /// Sets of channels whose encoded forms are kept; beyond, each subscriber encodes by itself.
  static constexpr std::size_t kKeptSets = 8;
  mutable Mutex mutex_;
  mutable std::map<std::uint32_t, std::vector<std::string>> encoded_ GUARDED_BY(mutex_);  ///< by channels
  mutable bool is_old_ GUARDED_BY(mutex_) = false;
};

/// One subscriber's own bounded queue. When it is full, or a sample has waited for kLongestQueued, the oldest
/// samples are dropped and counted. All clients' queues together hold kMaxQueued samples.
class Subscription {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxQueued = 1'000'000;
  static constexpr std::chrono::seconds kLongestQueued{60};

  struct Entry {
    std::shared_ptr<const RecordChunk> chunk;
    std::uint32_t index = 0;
    const rt::TickRecord& record() const { return chunk->records[index]; }
    void append_encoded(std::string& text, std::uint32_t channels, RecordChunk::Encode encode) const {
      chunk->append_encoded(text, index, channels, encode);
    }
  };
  struct Batch {
    std::vector<Entry> entries;
    std::uint64_t dropped_by_subscriber = 0;  ///< since the subscription began
    std::uint64_t dropped_by_server = 0;
  };

  Subscription(SubscriptionOptions options, std::uint64_t server_drops_before)
      : options_(std::move(options)), server_drops_before_(server_drops_before) {}

  /// Takes a batch if one is ready (full, old enough, or the last ones after close()); false if not.
  bool take(Batch& batch, Clock::time_point now);
  /// True when nothing more will come.
  bool ended() const;

 private:
  friend class TelemetryHub;
  /// `most`: samples that a client's queue may hold.
  void offer(const std::shared_ptr<const RecordChunk>& chunk, std::size_t most);
  void drop_oldest() REQUIRES(mutex_);
  bool ready(Clock::time_point now) const;
  bool ready_locked(Clock::time_point now) const REQUIRES(mutex_);
  void close();

  const SubscriptionOptions options_;
  const std::uint64_t server_drops_before_;
  mutable Mutex mutex_;
  std::deque<Entry> queue_ GUARDED_BY(mutex_);
  std::uint64_t dropped_ GUARDED_BY(mutex_) = 0;
  std::uint64_t server_drops_ GUARDED_BY(mutex_) = 0;
  bool closed_ GUARDED_BY(mutex_) = false;
};

/// Takes the loop's records out of its ring and hands them to the subscribers. One thread does all of it,
/// whatever other threads ask for; the loop knows nothing of it, and a subscriber that stalls or dies delays
/// neither it nor any other.
class TelemetryHub {
 public:
  explicit TelemetryHub(rt::Engine& engine) : engine_(engine) {}
  ~TelemetryHub();
  TelemetryHub(const TelemetryHub&) = delete;
  TelemetryHub& operator=(const TelemetryHub&) = delete;

  void start();
  /// Hands out the remaining records, then ends all subscriptions.
  void stop();

  std::shared_ptr<Subscription> subscribe(SubscriptionOptions options);
  void unsubscribe(const std::shared_ptr<Subscription>& subscription);

  /// Record of the last completed tick, so that a client that got a tick finds it here; all zero before the
  /// first. It has no angular velocity, which takes the ticks before. Straight from the loop, without
  /// waiting.
  rt::TickRecord latest() EXCLUDES(latest_mutex_);
  /// Returns when what the loop has written until now is in the queues of the subscribers: has the hub's
  /// thread make a round, and waits for it.
  void flush() EXCLUDES(rounds_mutex_);
  /// Clients that subscribe.
  std::uint32_t subscriber_count() const;
  /// Records that no subscriber saw because the loop's ring was full.
  std::uint64_t records_dropped() const { return engine_.records_dropped(); }

  /// Makes one round: takes what the loop has written and notifies those whose batch is ready. The hub's
  /// thread makes one every two milliseconds; one other thread may if it was not started.
  void pump(Subscription::Clock::time_point now);

 private:
  using Subscribers = std::vector<std::shared_ptr<Subscription>>;
  enum class Mode : std::uint8_t { kByHand, kRuns, kStopped };
  std::shared_ptr<const Subscribers> subscribers() const EXCLUDES(mutex_);
  void run();

  rt::Engine& engine_;

  // Members of the thread that pumps.
  AngularVelocity turning_;                                ///< of the records in the order of the ring
  std::size_t last_chunk_size_ = 0;                        ///< about as many come next
  std::deque<std::shared_ptr<const RecordChunk>> recent_;  ///< their encoded forms are kept

  Mutex latest_mutex_;  ///< lets one thread at a time read the loop's latest record
  mutable Mutex mutex_;
  std::shared_ptr<const Subscribers> subscribers_ GUARDED_BY(mutex_) = std::make_shared<const Subscribers>();
  bool closed_ GUARDED_BY(mutex_) = false;

  Mutex rounds_mutex_;
  Condition round_wanted_;
  Condition round_done_;
  Mode mode_ GUARDED_BY(rounds_mutex_) = Mode::kByHand;
  bool stop_requested_ GUARDED_BY(rounds_mutex_) = false;
  bool is_wanted_ GUARDED_BY(rounds_mutex_) = false;  ///< a round at once
  std::uint64_t begun_ GUARDED_BY(rounds_mutex_) = 0;
  std::uint64_t done_ GUARDED_BY(rounds_mutex_) = 0;
  std::thread thread_;
};

}  // namespace hapticd::server
