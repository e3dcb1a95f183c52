#include "server/pose/pose_publisher.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/telemetry/telemetry_hub.h"

namespace hapticd::pose {

namespace {

using server::Refusal;
using server::RefusalKind;

/// Delay after a tick's time by which its record is there, on most ticks.
constexpr std::int64_t kAfterTickNs = 250'000;
/// A tick that is late is waited for so often, each time so long.
constexpr int kMaxRetries = 3;
constexpr std::int64_t kRetryNs = 250'000;
/// Time without a pose that is due after which the thread looks whether the rig's clock has gone on.
constexpr std::chrono::milliseconds kMaxSleep{200};

Refusal ending() {
  return {RefusalKind::kUnavailable,
          {"the service is shutting down", "poses", "", "", "connect again later"}};
}

}  // namespace

/// What the thread alone uses.
struct PosePublisher::Work {
  Work(const hal::RigInfo& rig, const DeviceFrame& frame)
      : tick_period_ns(std::max<std::int64_t>(1, std::llround(1e9 / rig.rate_hz))),
        maker(rig.device, frame) {}

  /// First tick from a time on, by the rig's clock as the last tick has it.
  std::int64_t first_tick_from(std::int64_t time_ns) const {
    if (!maker.begun()) return time_ns;
    const std::int64_t last_ns = maker.last().time_ns - maker.last().timing.wakeup_ns;
    const std::int64_t ticks = (time_ns - last_ns + tick_period_ns - 1) / tick_period_ns;
    return last_ns + std::max<std::int64_t>(0, ticks) * tick_period_ns;
  }

  const std::int64_t tick_period_ns;

  PoseMaker maker;
  SceneFacts scene;
  std::uint32_t scene_generation = ~0U;
  RigClock clock;
  bool has_daemon_time = false;
  UtcRelation utc;
  std::int64_t utc_due_ns = 0;
  std::shared_ptr<server::Subscription> records;
  server::Subscription::Batch batch;
  int retries = 0;
};

PosePublisher::PosePublisher(Parts parts) : parts_(std::move(parts)) {}

PosePublisher::~PosePublisher() {
  stop();
}

std::optional<Refusal> PosePublisher::refusal(const PoseRequest& request) const {
  if (request.frame != PoseFrame::kReference) return std::nullopt;
  const auto adopted = parts_.calibration.get();
  if (adopted && adopted->registered) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {"no reference frame is known", "SubscribePosesRequest.frame", "POSE_FRAME_REFERENCE",
                  "an adopted calibration that registers the rig to a tracker",
                  adopted ? "the adopted calibration has no registration: calibrate with the tracker's poses"
                          : "calibrate and adopt a calibration, or take the frame POSE_FRAME_RIG"}};
}

std::optional<Refusal> PosePublisher::subscribe(const PoseRequest& request, double rate_hz,
                                                const std::shared_ptr<PoseReceiver>& receiver) {
  if (auto why = refusal(request)) return why;
  const MutexLock lock(mutex_);
  if (stopping_) return ending();
  Place place;
  place.request = request;
  place.period_ns = std::llround(1e9 / rate_hz);
  place.receiver = receiver;
  places_.push_back(std::move(place));
  // Not before it is needed: a daemon without visual clients has no thread more.
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  changed_.notify_one();
  return std::nullopt;
}

std::size_t PosePublisher::subscribers() const {
  const MutexLock lock(mutex_);
  return static_cast<std::size_t>(std::count_if(
      places_.begin(), places_.end(), [](const Place& place) { return !place.receiver.expired(); }));
}

void PosePublisher::stop() {
  std::vector<Place> ended;
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    ended.swap(places_);
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (const Place& place : ended) {
    if (const auto receiver = place.receiver.lock()) receiver->end(ending());
  }
}

void PosePublisher::open(Work& work) {
  if (work.records && !work.records->ended()) return;
  server::SubscriptionOptions options;
  options.batch_size = 4000;
  options.longest_wait = std::chrono::milliseconds(0);
  options.is_own = true;
  work.records = parts_.hub.subscribe(std::move(options));
}

void PosePublisher::take_records(Work& work) {
  parts_.hub.flush();
  while (work.records->take(work.batch, server::Subscription::Clock::now())) {
    for (const server::Subscription::Entry& entry : work.batch.entries) {
      const rt::TickRecord& record = entry.record();
      if (record.scene_generation != work.scene_generation) {
        work.scene_generation = record.scene_generation;
        work.scene = parts_.scene(record.scene_generation);
      }
      work.maker.follow(record, work.scene);
    }
    work.batch.entries.clear();
  }
}

void PosePublisher::look_at_utc(Work& work, std::int64_t now_ns) {
  if (now_ns < work.utc_due_ns) return;
  work.utc_due_ns = now_ns + 1'000'000'000;
  const server::ClockReading reading = server::read_clocks();
  const server::KernelClock kernel = server::kernel_clock();
  work.utc.utc_minus_monotonic_ns = reading.utc_ns - reading.monotonic_ns;
  work.utc.bound_ns = reading.apart_ns + (kernel.max_error_ms ? std::llround(1e6 * *kernel.max_error_ms) : 0);
  work.utc.keeping = kernel.utc;
}

void PosePublisher::hand_out(const Work& work, const std::vector<Place>& due) {
  const auto adopted = parts_.calibration.get();
  std::vector<IssuedPose> issued;
  issued.reserve(due.size());
  for (const Place& place : due) {
    const auto receiver = place.receiver.lock();
    if (!receiver) continue;
    if (const auto why = refusal(place.request)) {
      receiver->end(*why);
      continue;
    }
    auto same = std::find_if(issued.begin(), issued.end(),
                             [&](const IssuedPose& one) { return one.request == place.request; });
    if (same == issued.end()) {
      IssuedPose made;
      made.request = place.request;
      made.pose = work.maker.pose(place.request, adopted.get());
      made.clock = work.clock;
      made.has_daemon_time = work.has_daemon_time;
      made.utc = work.utc;
      issued.push_back(std::move(made));
      same = issued.end() - 1;
    }
    receiver->offer(*same);
  }
}

void PosePublisher::run() {
  pthread_setname_np(pthread_self(), "hapticd-poses");
  using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC, the daemon's
  Work work(parts_.rig, parts_.frame);
  std::vector<Place> due;
  MutexLock lock(mutex_);
  while (!stopping_) {
    std::erase_if(places_, [](const Place& place) { return place.receiver.expired(); });
    if (places_.empty()) {
      if (work.records) {
        parts_.hub.unsubscribe(work.records);
        work.records.reset();
      }
      changed_.wait(mutex_);
      continue;
    }
    lock.unlock();
    open(work);
    const auto reading = parts_.reading();
    work.has_daemon_time = reading.has_value();
    if (reading) work.clock.follow(*reading);
    const std::int64_t now_ns = server::monotonic_ns();
    look_at_utc(work, now_ns);
    // The grid that poses are due on: the rig's clock if it runs with the daemon's.
    const std::int64_t shift_ns = reading ? work.clock.daemon_time(0)->time_ns : 0;
    lock.lock();

    std::int64_t next_ns = now_ns + std::chrono::nanoseconds(kMaxSleep).count() - shift_ns;
    for (Place& place : places_) {
      if (place.due_ns == 0 || std::abs(place.due_ns - (now_ns - shift_ns)) > 2 * place.period_ns) {
        place.due_ns = ((now_ns - shift_ns) / place.period_ns + 1) * place.period_ns;
      }
      next_ns = std::min(next_ns, place.due_ns);
    }
    // With the first tick from then on: a pose is of a tick, and never of the next one.
    const std::int64_t tick_ns = reading ? work.first_tick_from(next_ns) : next_ns;
    const std::int64_t wake_ns = tick_ns + shift_ns + (reading ? kAfterTickNs : 0) + work.retries * kRetryNs;
    const auto until = Clock::time_point(std::chrono::nanoseconds(wake_ns));
    if (now_ns < wake_ns) {
      const std::size_t before = places_.size();
      changed_.wait_until(mutex_, until);
      if (stopping_) break;
      if (server::monotonic_ns() < wake_ns || places_.size() != before) continue;
    }
    lock.unlock();
    take_records(work);
    const bool is_late = reading && work.maker.begun() && work.retries < kMaxRetries &&
                         work.maker.last().time_ns < tick_ns - work.tick_period_ns / 2;
    lock.lock();
    if (is_late) {
      ++work.retries;
      continue;
    }
    work.retries = 0;
    due.clear();
    for (Place& place : places_) {
      if (place.due_ns > tick_ns) continue;
      place.due_ns += place.period_ns;
      const bool has_new =
          work.maker.begun() && (!place.got_one || place.last_tick != work.maker.last().tick);
      if (!has_new) continue;
      place.got_one = true;
      place.last_tick = work.maker.last().tick;
      due.push_back(place);
    }
    lock.unlock();
    hand_out(work, due);
    due.clear();
    lock.lock();
  }
  lock.unlock();
  if (work.records) parts_.hub.unsubscribe(work.records);
}

}  // namespace hapticd::pose
