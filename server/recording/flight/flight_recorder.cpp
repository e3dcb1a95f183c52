#include "server/recording/flight/flight_recorder.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "hal/recording/recording_names.h"
#include "rt/guard/fault_table.h"
#include "server/process/log.h"
#include "server/process/system_clock.h"
#include "server/recording/flight/ring_folder.h"
#include "server/recording/recorder.h"

namespace hapticd::server {

namespace {

using recording::Event;
using recording::EventKind;

constexpr std::chrono::milliseconds kRingPoll{20};
constexpr std::chrono::seconds kAnchorEvery{10};
/// A loop without a tick for so long has ended, or its device was lost.
constexpr std::chrono::seconds kStandsStill{4};
/// Causes that come one after another are one incident, but not for longer than the ring lasts.
constexpr double kMaxAfterS = 8.0;
constexpr std::int64_t kQuietNs = 600'000'000'000;
constexpr auto kRingNs = static_cast<std::int64_t>(1e9 * FlightRecorder::kRingS);
constexpr std::size_t kMaxRequest = 1024;
constexpr std::uint32_t kRecordsAtOnce = 2048;
constexpr double kQueueS = 10.0;
constexpr const char* kRequested = "requested";

std::uint64_t ticks_in(double seconds, double rate_hz) {
  return static_cast<std::uint64_t>(std::llround(seconds * rate_hz));
}

/// Weight of an incident: of causes that come one after another, the one that names it.
int weight_of(const Incident& incident) {
  if (incident.cause == "overrun") return 0;
  return incident.cause == kRequested ? 1 : 2;
}

}  // namespace

FlightRecorder::FlightRecorder(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources,
                               const RecordingConfig& config)
    : hub_(hub),
      event_log_(event_log),
      sources_(sources),
      config_(config),
      folder_(config.folder + "/incidents", {config.incident_quota_mb, WhenFull::kRemoveOldest, 0.0,
                                             "[recording] incident_quota_mb", kRequested}),
      table_(sources.columns, sources.channels) {}

FlightRecorder::~FlightRecorder() {
  shutdown();
}

std::optional<hal::Error> FlightRecorder::open() {
  if (config_.folder.empty() || !config_.flight_recorder) return std::nullopt;
  problem_ = folder_.open();
  if (problem_) return problem_;
  for (const std::string& line : folder_.repair_all()) log_warning(line);
  if (const auto all = folder_.list(); !all.empty()) {
    const MutexLock lock(mutex_);
    last_ = Last{all.back().id, all.back().end_reason};
  }
  auto ring = take_ring(config_.ring_folder.empty() ? config_.folder : config_.ring_folder, table_.columns(),
                        ticks_in(kRingS, sources_.rate_hz), sources_.rate_hz, left_);
  if (!ring) {
    problem_ = ring.error();
    return problem_;
  }
  ring_ = std::move(*ring);
  notes_[recording::kStartMetadata] = sources_.rig;
  static_cast<void>(ring_->set_anchor(anchor_of(sources_)));
  SubscriptionOptions options;
  options.batch_size = kRecordsAtOnce;
  options.is_own = true;
  options.longest_wait = std::chrono::milliseconds(0);
  options.queue_samples = static_cast<std::uint32_t>(ticks_in(kQueueS, sources_.rate_hz));
  subscription_ = hub_.subscribe(options);
  event_number_ = event_log_.last();
  is_on_.store(true);
  thread_ = std::thread([this] { run(); });
  writer_ = std::thread([this] { run_writer(); });
  return std::nullopt;
}

void FlightRecorder::shutdown() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  signal_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (writer_.joinable()) writer_.join();
  is_on_.store(false);
  if (ring_) ring_->remove();
  ring_.reset();
}

std::optional<Refusal> FlightRecorder::unavailable() const {
  if (config_.folder.empty() || !config_.flight_recorder) {
    return Refusal{
        RefusalKind::kFailedPrecondition,
        hal::Error::of(hal::ErrorCode::kSwitchedOff, "the flight recorder is off",
                       "[recording] flight_recorder, folder", "", "",
                       config_.folder.empty()
                           ? "name a folder, or start hapticd with a --model-store that is not in memory"
                           : "set flight_recorder = true")};
  }
  if (problem_) return Refusal{RefusalKind::kFailedPrecondition, *problem_};
  return std::nullopt;
}

std::optional<Refusal> FlightRecorder::request(const std::string& reason, const std::string& by) {
  if (auto refusal = unavailable()) return refusal;
  if (reason.size() > kMaxRequest) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"the reason is too long", "MakeIncidentRequest.reason", fmt::format("{} bytes", reason.size()),
         fmt::format("at most {} bytes", kMaxRequest), ""}};
  }
  Event event;
  event.kind = EventKind::kAnnotation;
  event.text = reason.empty() ? "an incident was requested" : reason;
  event.by = by;
  const MutexLock lock(mutex_);
  if (requests_.size() >= kMaxRequests) {
    return Refusal{RefusalKind::kResourceExhausted,
                   {"too many incidents are requested at once", "MakeIncident", std::to_string(kMaxRequests),
                    "", "one request keeps all that happens around it"}};
  }
  requests_.push_back(std::move(event));
  return std::nullopt;
}

Outcome<std::vector<RecordingInfo>> FlightRecorder::list() const {
  if (auto refusal = unavailable()) return *refusal;
  return folder_.list();
}

Outcome<std::string> FlightRecorder::path_of(const std::string& id) const {
  if (auto refusal = unavailable()) return *refusal;
  const auto path = folder_.find(id);
  if (!path) return no_such_recording(id, folder_.ids());
  return *path;
}

Outcome<RecordingInfo> FlightRecorder::remove(const std::string& id) {
  const auto path = path_of(id);
  if (!path) return path.refusal();
  RecordingInfo info = read_info(*path);
  if (auto error = folder_.remove(id)) return Refusal{RefusalKind::kFailedPrecondition, *error};
  const MutexLock lock(mutex_);
  if (last_ && last_->id == id) last_.reset();
  return info;
}

std::optional<FlightRecorder::Last> FlightRecorder::last() const {
  const MutexLock lock(mutex_);
  return last_;
}

void FlightRecorder::run() {
  pthread_setname_np(pthread_self(), "flight");
  MutexLock lock(mutex_);
  while (!ending_) {
    signal_.wait_for(mutex_, kRingPoll);
    lock.unlock();
    take_records();
    note_scene();
    finish_pending(false);
    lock.lock();
  }
  lock.unlock();
  hub_.flush();
  take_records();
  finish_pending(true);
  hub_.unsubscribe(subscription_);
  lock.lock();
  ring_ended_ = true;
  lock.unlock();
  signal_.notify_all();
}

void FlightRecorder::take_records() {
  std::deque<Event> requests;
  {
    const MutexLock lock(mutex_);
    requests.swap(requests_);
  }
  Subscription::Batch batch;
  while (subscription_->take(batch, Clock::now())) {
    last_record_ = Clock::now();
    for (const Subscription::Entry& entry : batch.entries) {
      const rt::TickRecord& record = entry.record();
      table_.append_row(record, rows_);
      last_tick_ = record.tick;
      last_time_ns_ = record.time_ns;
      const bool is_first = first_looks_++ == 0;
      for (WatchedEvent& watched : watch_.look(record)) {
        Event& event = watched.event;
        if (event.kind == EventKind::kScene) scene_changed_ = true;
        event.unix_ns = read_clocks().utc_ns;
        if (!is_first && !ends_.load()) look_at(watched);
        events_.push_back(std::move(event));
      }
    }
    if (const auto error = ring_->write(rows_); error && !std::exchange(write_failed_, true)) {
      log_error("flight recorder: " + error->text());
    }
    rows_.clear();
    rows_kept_ += batch.entries.size();
  }
  std::uint64_t missed = 0;
  for (Event& event : event_log_.after(event_number_, missed)) {
    if (event.kind == EventKind::kScene) scene_changed_ = true;
    const bool shows_in_no_record = event.kind == EventKind::kStop && watch_.is_latched_without_stop();
    if (shows_in_no_record && !ends_.load()) begin_incident(incident_of(event, "stopped"));
    events_.push_back(std::move(event));
  }
  for (Event& request : requests) {
    request.tick = last_tick_;
    request.time_ns = last_time_ns_;
    request.unix_ns = read_clocks().utc_ns;
    events_.push_back(request);
    begin_incident(incident_of(request, kRequested));
  }
  while (!events_.empty() && events_.front().time_ns < last_time_ns_ - kRingNs) events_.pop_front();
  for (; events_.size() > kMaxEvents; events_.pop_front()) left_out_ns_ = events_.front().time_ns;
}

Incident FlightRecorder::incident_of(const Event& event, const std::string& cause) const {
  Incident incident;
  incident.cause = cause;
  incident.words = event.text + (event.by.empty() ? "" : " (by " + event.by + ")");
  incident.tick = event.tick;
  incident.time_ns = event.time_ns;
  incident.unix_ns = event.unix_ns;
  const std::uint64_t row = ring_->written() + rows_.size() / ring_->row_bytes();
  const std::uint64_t before = ticks_in(kBeforeS, sources_.rate_hz);
  // The tick of the cause itself comes after those before it.
  incident.first_row = row > before + 1 ? row - before - 1 : 0;
  return incident;
}

void FlightRecorder::look_at(const WatchedEvent& watched) {
  const Event& event = watched.event;
  if (event.kind == EventKind::kStop) return begin_incident(incident_of(event, "stopped"));
  const bool is_overrun = event.kind == EventKind::kOverrun;
  if (event.kind != EventKind::kFault && !is_overrun) return;
  if (watched.fault == rt::GuardFault::kUncleanEnd) return;  // the ring that was left says it
  const std::string cause =
      is_overrun ? std::string("overrun") : std::string(rt::rule_of(watched.fault).name);
  if (is_overrun || watched.ends_by_itself) {
    std::int64_t& quiet_until_ns = quiet_until_ns_[cause];
    if (quiet_until_ns > event.time_ns) return;
    quiet_until_ns = event.time_ns + kQuietNs;
  }
  Incident incident = incident_of(event, cause);
  incident.remedy = is_overrun
                        ? "see what took the time in hapticctl status; hapticctl doctor says how to set up "
                          "the machine"
                        : std::string(rt::rule_of(watched.fault).remedy);
  begin_incident(std::move(incident));
}

void FlightRecorder::begin_incident(Incident incident) {
  const std::uint64_t due_tick = incident.tick + ticks_in(kAfterS, sources_.rate_hz);
  if (pending_) {
    Incident& first = pending_->incident;
    if (weight_of(incident) > weight_of(first)) {
      // What took the force names the incident; it keeps what was before the first.
      incident.words += "; before: " + first.words;
      incident.first_row = first.first_row;
      first = std::move(incident);
    } else if (first.words.size() < kMaxWords) {
      first.words += "; then " + incident.words;
    } else {
      ++pending_->unnamed;
    }
    pending_->due_tick = std::min(due_tick, pending_->latest_tick);
    return;
  }
  pending_ = Pending{};
  pending_->incident = std::move(incident);
  pending_->due_tick = due_tick;
  pending_->latest_tick = pending_->incident.tick + ticks_in(kMaxAfterS, sources_.rate_hz);
}

void FlightRecorder::finish_pending(bool now) {
  if (!pending_) return;
  // A loop that no longer ticks is not waited for.
  const bool stands_still = Clock::now() - last_record_ > kStandsStill;
  if (!now && last_tick_ < pending_->due_tick && !stands_still) return;
  Incident incident = std::move(pending_->incident);
  if (pending_->unnamed > 0) incident.words += fmt::format("; and {} more", pending_->unnamed);
  pending_.reset();
  incident.row_count = ring_->written() - incident.first_row;
  incident.events.assign(events_.begin(), events_.end());
  if (left_out_ns_ >= last_time_ns_ - kRingNs) {
    Event event = events_.front();
    event.kind = EventKind::kLoss;
    event.by.clear();
    event.text = "events before this one are missing: there were too many at once";
    incident.events.insert(incident.events.begin(), std::move(event));
  }
  {
    const MutexLock lock(mutex_);
    orders_.push_back({std::move(incident), notes_});
  }
  signal_.notify_all();
}

void FlightRecorder::note_scene() {
  const Clock::time_point now = Clock::now();
  if (now >= anchor_due_) {
    anchor_due_ = now + kAnchorEvery;
    static_cast<void>(ring_->set_anchor(anchor_of(sources_)));
  }
  if (!std::exchange(scene_changed_, false)) return;
  notes_[recording::kSceneMetadata] = sources_.scene();
  static_cast<void>(ring_->set_notes(notes_));
}

void FlightRecorder::run_writer() {
  pthread_setname_np(pthread_self(), "incident");
  keep_left_rings();
  MutexLock lock(mutex_);
  for (;;) {
    while (!ring_ended_ && orders_.empty()) signal_.wait(mutex_);
    if (orders_.empty()) return;
    const Order order = std::move(orders_.front());
    orders_.pop_front();
    lock.unlock();
    write(order.incident, *ring_, order.notes);
    lock.lock();
  }
}

void FlightRecorder::write(const Incident& incident, const FlightRing& ring, const FlightRing::Notes& notes) {
  const std::string path = folder_.new_path(incident.unix_ns, incident.cause);
  const std::string id = std::filesystem::path(path).stem().string();
  if (const auto full = folder_.make_room(id)) log_warning("flight recorder: " + full->text());
  if (const auto error = write_incident(incident, ring, sources_, notes, path)) {
    log_error("incident '" + id + "' could not be written whole: " + error->text());
  }
  static_cast<void>(folder_.make_room(id));
  log_warning("incident '" + id + "': " + incident.words);
  ++incidents_written_;
  Event event;
  event.time_ns = incident.time_ns;
  event.tick = incident.tick;
  event.unix_ns = incident.unix_ns;
  event.kind = EventKind::kIncident;
  event.text = id + ": " + incident.words;
  event_log_.add(std::move(event));
  const MutexLock lock(mutex_);
  last_ = Last{id, incident.words};
}

void FlightRecorder::keep_left_rings() {
  for (const std::string& path : left_) {
    const auto ring = FlightRing::open_left(path);
    std::error_code ignored;
    if (!ring) {
      log_warning("flight recorder: " + ring.error().text() + "; it is removed");
      std::filesystem::remove(path, ignored);
      continue;
    }
    const FlightRing& left = **ring;
    Incident incident;
    incident.cause = "unclean_end";
    incident.words =
        "an earlier run of the daemon ended in no orderly way (a crash, a kill, a loss of power): its last "
        "seconds";
    incident.remedy = "read in the log why it ended";
    incident.row_count = std::min(left.written(), left.capacity_rows());
    incident.first_row = left.written() - incident.row_count;
    std::string rows;
    if (incident.row_count > 0 && left.read(left.written() - 1, 1, rows)) {
      const recording::Row row(rows.data(), left.columns());
      incident.tick = static_cast<std::uint64_t>(row.integer(0));
      incident.time_ns = row.integer(1);
      incident.unix_ns = left.anchor().unix_at(incident.time_ns);
      write(incident, left, left.notes());
    }
    (*ring)->remove();
  }
}

}  // namespace hapticd::server
