#include "server/identification/run/identification_runner.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "hal/sim/object/phantom_body.h"
#include "server/identification/run/identification_run.h"
#include "server/identification/run/inclusion_reference.h"
#include "server/model/store/model_store.h"
#include "server/process/log.h"
#include "server/process/thread_start.h"
#include "server/rig/sensor_bias.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

IdentificationState state_of(const std::string& text) {
  for (const auto state :
       {IdentificationState::kConverged, IdentificationState::kPartial, IdentificationState::kCancelled}) {
    if (text == text_of(state)) return state;
  }
  return IdentificationState::kFailed;
}

constexpr const char* kStartPlace = "StartIdentificationRequest";

Refusal shutting_down() {
  return {RefusalKind::kUnavailable,
          {"the service is shutting down", kStartPlace, "", "", "connect again later"}};
}

/// Checks a request by itself.
std::optional<Refusal> check_request(const IdentificationRequest& request) {
  if (auto refusal = check(request.task)) return refusal;
  if (is_about_object(request.task)) {
    if (auto error = check_name("object", request.object, std::string(kStartPlace) + ".object")) {
      return Refusal{RefusalKind::kInvalidArgument, *error};
    }
  } else if (!request.object.empty()) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {std::string("an identification of kind '") + kind_name(request.task) +
                        "' is about the rig, not about an object",
                    std::string(kStartPlace) + ".object", request.object, "empty", "leave it out"}};
  }
  if (request.time_limit_s >= 1.0 && request.time_limit_s <= 3600.0) return std::nullopt;
  return Refusal{
      std::isfinite(request.time_limit_s) ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument,
      {"the time limit is out of range", std::string(kStartPlace) + ".time_limit_s",
       fmt::format("{} s", request.time_limit_s), "1 … 3600 s", "choose a time in the range"}};
}

/// Number of an id: "contact-7" → 7.
std::uint64_t number_of(const std::string& id) {
  const std::size_t dash = id.rfind('-');
  return dash == std::string::npos ? 0 : std::strtoull(id.c_str() + dash + 1, nullptr, 10);
}

}  // namespace

IdentificationRunner::IdentificationRunner(Session& session, SceneHost& scenes, TelemetryHub& hub,
                                           const SensorBiases& biases, ModelStore& store)
    : session_(session), scenes_(scenes), hub_(hub), biases_(biases), store_(store) {
  // Identifications of earlier runs of the daemon are kept, and their names not used again.
  const auto ended = store_.list_identifications(kKept);
  if (!ended) return;
  for (const EndedIdentification& one : *ended) {
    IdentificationReport report;
    report.id = one.id;
    report.kind = one.kind;
    report.object = one.object;
    report.state = state_of(one.state);
    report.is_of_earlier_run = true;
    report.model = one.model_hash;
    report.version = 1;
    if (!one.problem.empty()) report.problem = hal::Error{one.problem, "", "", "", ""};
    started_ = std::max(started_, number_of(one.id));
    reports_.push_back(std::move(report));
  }
}

IdentificationRunner::~IdentificationRunner() {
  shutdown();
}

void IdentificationRunner::shutdown() {
  {
    const MutexLock lock(mutex_);
    shut_down_ = true;
    cancel_.store(true);
    while (starting_) changed_.wait(mutex_);  // it sees that it is given up
  }
  if (thread_.joinable()) thread_.join();
}

class IdentificationRunner::Turn {
 public:
  Turn(IdentificationRunner& runner, std::string id) : id_(std::move(id)), runner_(runner) {}
  ~Turn() {
    {
      const MutexLock lock(runner_.mutex_);
      runner_.starting_ = false;
    }
    runner_.changed_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  const std::string& id() const { return id_; }

 private:
  const std::string id_;
  IdentificationRunner& runner_;
};

Outcome<std::string> IdentificationRunner::start(const IdentificationRequest& request, std::uint64_t lease) {
  if (auto refusal = check_request(request)) return *refusal;
  const auto turn = take_turn(request, lease);
  if (!turn) return turn.refusal();
  auto run = std::make_unique<Run>();
  run->request = request;
  run->id = (*turn)->id();
  if (auto refusal = fill_reference(run->request, recordings_, scenes_.models(), cancel_)) return *refusal;
  if (auto refusal = request.recording.empty() ? prepare_live(*run) : prepare_recorded(*run)) return *refusal;
  return begin(std::move(run), **turn);
}

Outcome<std::unique_ptr<IdentificationRunner::Turn>> IdentificationRunner::take_turn(
    const IdentificationRequest& request, std::uint64_t lease) {
  const MutexLock lock(mutex_);
  if (shut_down_) return shutting_down();
  const bool runs = !reports_.empty() && reports_.front().state == IdentificationState::kRunning;
  if (runs || starting_) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"another identification is under way", kStartPlace, runs ? reports_.front().id : "",
                    "one at a time", "wait until it is over, or cancel it"},
                   Reason::kBusy};
  }
  starting_ = true;
  lease_ = request.recording.empty() ? lease : 0;
  lost_control_.reset();
  cancel_.store(false);
  return std::make_unique<Turn>(*this, fmt::format("{}-{}", kind_name(request.task), started_ + 1));
}

std::optional<Refusal> IdentificationRunner::prepare_recorded(Run& run) {
  const IdentificationRequest& request = run.request;
  const auto motion = recorded_motion(request.task);
  if (!motion) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {std::string("an identification of kind '") + kind_name(request.task) + "' needs the rig",
         std::string(kStartPlace) + ".recording", request.recording,
         "contact, friction, structural_stiffness, tool, threshold or inclusion", "identify it on the rig"}};
  }
  auto recording = recordings_.find(request.recording);
  if (!recording) return recording.refusal();
  run.recording = *recording;
  auto rows = RecordedObservations::open(run.recording->file.path(), *motion, run.recording->description,
                                         request.geometry.press_direction, &cancel_);
  if (!rows) return Refusal{RefusalKind::kInvalidArgument, rows.error()};
  if (auto* friction = std::get_if<identification::FrictionTask>(&run.request.task)) {
    friction->normal_force_n = run.recording->normal_force_n;
  }
  if (auto refusal = check(run.request.task)) return *refusal;
  run.identification = make_identification(run.request.task, rows->rig_info());
  run.rows = std::move(*rows);
  return std::nullopt;
}

std::optional<Refusal> IdentificationRunner::prepare_live(Run& run) {
  const IdentificationRequest& request = run.request;
  if (auto refusal = session_.unavailable()) return *refusal;
  if (auto refusal = check_rig(request.task, session_.rig_info())) return *refusal;
  if (is_held_back(request.task)) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"the guard is latched", "guard", "", "", "fix the cause and clear it first"},
                   Reason::kGuardLatched};
  }
  const bool presses_down_only =
      session_.simulation() != nullptr || std::holds_alternative<identification::InclusionTask>(request.task);
  if (auto refusal = check_geometry(request.geometry, presses_down_only)) return *refusal;
  if (const auto scene = scenes_.current()) run.usual = scene->spec.guard;
  auto reservation = scenes_.reserve("identification '" + run.id + "'");
  if (!reservation) return reservation.refusal();
  run.reservation.emplace(std::move(*reservation));
  const hal::RigInfo& rig = session_.rig_info();
  run.view.emplace(request.task, request.geometry, rig, scenes_.models().of_rig(rig),
                   biases_.zero_in_force());
  auto* inclusion = std::get_if<identification::InclusionTask>(&run.request.task);
  if (inclusion != nullptr && !inclusion->tip_radius_mm && session_.simulation() != nullptr) {
    inclusion->tip_radius_mm = sim::PhantomParameters::kTipRadiusMm;
  }
  run.identification = make_identification(run.request.task, run.view->rig_info());
  if (store_.in_memory()) return std::nullopt;
  auto kept = ObservationFile::create(store_.path() + ".data/" + run.id + ".csv", rig.has_external_position,
                                      recordings_.keep_free_mb());
  if (kept) {
    run.kept.emplace(std::move(*kept));
  } else {
    log_warning(kept.error().text());
  }
  return std::nullopt;
}

Outcome<std::string> IdentificationRunner::begin(std::unique_ptr<Run> run, Turn& turn) {
  if (thread_.joinable())
    thread_.join();  // the last one has reported its end: it writes that down and leaves
  IdentificationReport report;
  report.id = turn.id();
  report.kind = kind_name(run->request.task);
  report.object = run->request.object;
  report.recording = run->request.recording;
  report.time_limit_s = run->request.time_limit_s;
  report.version = 1;
  // Its thread takes the run from here: it stays, to be discarded, if there is no thread.
  const auto held = std::make_shared<std::unique_ptr<Run>>(std::move(run));
  std::optional<Refusal> refusal;
  {
    const MutexLock lock(mutex_);
    if (shut_down_) {
      refusal = shutting_down();
    } else if (lost_control_) {  // while it was prepared
      refusal = Refusal{RefusalKind::kAborted, *lost_control_, Reason::kLeaseLost};
    } else if (auto error = start_thread(thread_, [this, held] {
                 const std::unique_ptr<Run> own = std::move(*held);
                 perform(*own);
               })) {
      refusal = Refusal{RefusalKind::kResourceExhausted, std::move(*error)};
    } else {  // its thread waits for the lock before it reports anything
      ++started_;
      reports_.push_front(std::move(report));
      if (reports_.size() > kKept) reports_.pop_back();
    }
  }
  if (refusal) {
    if ((*held)->kept) (*held)->kept->discard();
    return *refusal;
  }
  log_info("identification '" + turn.id() + "' begins");
  return turn.id();
}

void IdentificationRunner::perform(Run& run) {
  pthread_setname_np(pthread_self(), "identification");
  const Ended ended = run.rows ? listen_to_recording(run) : listen_to_rig(run);
  conclude(run, ended);
}

void IdentificationRunner::publish(const Run& run, const identification::IdentificationProgress& progress) {
  {
    const MutexLock lock(mutex_);
    IdentificationReport& report = reports_.front();
    report.progress = progress;
    report.instruction = run.instruction;
    ++report.version;
  }
  changed_.notify_all();
}

IdentificationReport* IdentificationRunner::find_locked(const std::string& id) {
  if (id.empty()) return reports_.empty() ? nullptr : &reports_.front();
  for (IdentificationReport& report : reports_) {
    if (report.id == id) return &report;
  }
  return nullptr;
}

Outcome<IdentificationReport> IdentificationRunner::report(const std::string& id, std::uint64_t newer_than,
                                                           const Caller& caller) {
  constexpr std::chrono::milliseconds kSlice{50};
  MutexLock lock(mutex_);
  const IdentificationReport* found = find_locked(id);
  if (found == nullptr) {
    std::vector<std::string> ids;
    for (const IdentificationReport& report : reports_) ids.push_back(report.id);
    return Refusal{
        RefusalKind::kNotFound,
        {ids.empty() ? "nothing was identified since the daemon started" : "no such identification",
         "identification", id, comma_separated(ids), "list them"}};
  }
  const std::string wanted = found->id;  // others may begin while this one is waited for
  while (found != nullptr && found->version <= newer_than && found->state == IdentificationState::kRunning &&
         !shut_down_) {
    changed_.wait_for(mutex_, kSlice);
    lock.unlock();
    const bool caller_waits = Clock::now() < caller.deadline && !caller.cancelled();
    lock.lock();
    found = find_locked(wanted);
    if (!caller_waits) break;
  }
  if (found == nullptr) {
    return Refusal{RefusalKind::kNotFound,
                   {"it is too long ago", "identification", wanted, "the last 64", ""}};
  }
  return *found;
}

Outcome<IdentificationReport> IdentificationRunner::cancel(const std::string& id, const Caller& caller) {
  auto now = report(id, 0, caller);
  if (!now) return now;
  {
    // Whether it is the one that runs is decided under the lock: a later one is not to be hit.
    const MutexLock lock(mutex_);
    const IdentificationReport* found = find_locked(now->id);
    if (found != nullptr && found->state == IdentificationState::kRunning) cancel_.store(true);
  }
  while (now && now->state == IdentificationState::kRunning) {
    if (caller.cancelled() || Clock::now() >= caller.deadline) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"it ends, but has not yet", "identification", now->id, "", "watch it"}};
    }
    now = report(now->id, now->version, caller);
  }
  return now;
}

void IdentificationRunner::end_under(std::uint64_t lease, const hal::Error& why) {
  const MutexLock lock(mutex_);
  const bool runs =
      starting_ || (!reports_.empty() && reports_.front().state == IdentificationState::kRunning);
  if (!runs || lease == 0 || lease_ != lease) return;
  lost_control_ = why;
  cancel_.store(true);
}

std::vector<IdentificationReport> IdentificationRunner::list() const {
  const MutexLock lock(mutex_);
  return {reports_.begin(), reports_.end()};
}

}  // namespace hapticd::server
