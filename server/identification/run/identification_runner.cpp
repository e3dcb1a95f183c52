#include "server/identification/run/identification_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "hal/tip_instrument.h"
#include "rt/record/tick_record.h"
#include "server/identification/palpation/requested_scene.h"
#include "server/identification/palpation/simulated_palpator.h"
#include "server/identification/run/observation_file.h"
#include "server/identification/run/rig_view.h"
#include "server/identification/run/sample_watch.h"
#include "server/model/store/model_store.h"
#include "server/process/log.h"
#include "server/rig/sensor_bias.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kReportEvery{100};
constexpr std::chrono::milliseconds kPollInterval{1};
constexpr std::chrono::seconds kMaxSilence{5};
/// What was found is worth waiting for another process that keeps the store locked.
constexpr std::chrono::seconds kStoreTimeout{10};
/// Of a person it is asked this often what should happen next, of the simulated hand once it has done it: a
/// person goes on without waiting, and the device has to follow at once.
constexpr double kAskUserEveryS = 0.1;
constexpr std::size_t kRowsBetweenLooks = 4096;
constexpr std::uint64_t kTicksBetweenLooks = 5;

std::string text_of(IdentificationState state) {
  switch (state) {
    case IdentificationState::kRunning:
      return "running";
    case IdentificationState::kConverged:
      return "converged";
    case IdentificationState::kPartial:
      return "partial";
    case IdentificationState::kCancelled:
      return "cancelled";
    case IdentificationState::kFailed:
      return "failed";
  }
  return "";
}

IdentificationState state_of(const std::string& text) {
  for (const auto state :
       {IdentificationState::kConverged, IdentificationState::kPartial, IdentificationState::kCancelled}) {
    if (text == text_of(state)) return state;
  }
  return IdentificationState::kFailed;
}

/// "contact-7" → 7.
std::uint64_t number_of(const std::string& id) {
  const std::size_t dash = id.rfind('-');
  return dash == std::string::npos ? 0 : std::strtoull(id.c_str() + dash + 1, nullptr, 10);
}

/// The rig's instrument from outside, open for as long as it is wanted. Only identifications use it,
/// and one of them at a time.
class OpenInstrument {
 public:
  OpenInstrument() = default;
  OpenInstrument(const OpenInstrument&) = delete;
  OpenInstrument& operator=(const OpenInstrument&) = delete;
  ~OpenInstrument() { close(); }

  /// Where there is hardware behind it; a simulated one is always there.
  std::optional<hal::Error> open(hal::Rig& rig) {
    rig_ = dynamic_cast<hal::InstrumentedRig*>(&rig);
    return rig_ == nullptr ? std::nullopt : rig_->engage_instrument();
  }
  void close() noexcept {
    if (auto* const rig = std::exchange(rig_, nullptr)) rig->disengage_instrument();
  }

 private:
  hal::InstrumentedRig* rig_ = nullptr;
};

}  // namespace

/// One identification under way; lives in its thread.
struct IdentificationRunner::Run {
  IdentificationRequest request;
  std::string id;
  std::unique_ptr<rt::Identification> identification;
  std::shared_ptr<const ShelvedRecording> recording;
  std::optional<RecordedObservations> rows;
  std::optional<SceneHost::Reservation> reservation;
  std::optional<SensorClaim> sensor;    ///< held open for as long as it listens
  OpenInstrument instrument;            ///< the same
  std::optional<RigView> view;          ///< of the live rig
  std::optional<ObservationFile> kept;  ///< what the rig measured, where the store has a place for it
  std::string instruction;
  rt::MotionRequest::Device device = rt::MotionRequest::Device::kNothing;  ///< what it does now
  std::optional<rt::SceneSpec> rendered;                                   ///< the scene that does it
  rt::GuardLimits usual;  ///< of the scene before: how late sensor and loop may be on this rig
};

IdentificationRunner::IdentificationRunner(Session& session, SceneHost& scenes, TelemetryHub& hub,
                                           const SensorBiases& biases, ModelStore& store)
    : session_(session), scenes_(scenes), hub_(hub), biases_(biases), store_(store) {
  // Those of earlier runs of the daemon are kept, and their names not used again.
  const auto ended = store_.list_identifications(kKept);
  if (!ended) return;
  for (const EndedIdentification& one : *ended) {
    IdentificationReport report;
    report.id = one.id;
    report.kind = one.kind;
    report.object = one.object;
    report.state = state_of(one.state);
    report.model = one.model_hash;
    report.version = 1;
    report.progress.residual = std::numeric_limits<double>::quiet_NaN();  // no longer known
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
    const std::lock_guard lock(mutex_);
    shut_down_ = true;
  }
  cancel_.store(true);
  if (thread_.joinable()) thread_.join();
}

Outcome<std::string> IdentificationRunner::start(const IdentificationRequest& request) {
  constexpr const char* kPlace = "StartIdentificationRequest";
  if (auto refusal = check(request.task)) return *refusal;
  const bool about_object = is_about_object(request.task);
  const std::string kind = kind_name(request.task);
  if (about_object) {
    if (auto error = check_name("object", request.object, std::string(kPlace) + ".object")) {
      return Refusal{RefusalKind::kInvalidArgument, *error};
    }
  } else if (!request.object.empty()) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"an identification of kind '" + kind + "' is about the rig, not about an object",
                    std::string(kPlace) + ".object", request.object, "empty", "leave it out"}};
  }
  if (!(request.time_limit_s >= 1.0 && request.time_limit_s <= 3600.0)) {
    return Refusal{
        std::isfinite(request.time_limit_s) ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument,
        {"the time limit is out of range", std::string(kPlace) + ".time_limit_s",
         fmt::format("{} s", request.time_limit_s), "1 … 3600 s", "choose a time in the range"}};
  }

  auto run = std::make_unique<Run>();
  run->request = request;
  const std::unique_lock lock(mutex_);
  if (shut_down_) {
    return Refusal{RefusalKind::kUnavailable,
                   {"the service is shutting down", kPlace, "", "", "connect again later"}};
  }
  if (!reports_.empty() && reports_.front().state == IdentificationState::kRunning) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"another identification is under way", kPlace, reports_.front().id, "one at a time",
                    "wait until it is over, or cancel it"},
                   Reason::kBusy};
  }
  run->id = fmt::format("{}-{}", kind, started_ + 1);
  if (!request.recording.empty()) {
    const auto motion = recorded_motion(request.task);
    if (!motion) {
      return Refusal{
          RefusalKind::kInvalidArgument,
          {"an identification of kind '" + kind + "' needs the rig", std::string(kPlace) + ".recording",
           request.recording, "contact, friction, structural_stiffness, tool or threshold",
           "identify it on the rig"}};
    }
    auto recording = shelf_.find(request.recording);
    if (!recording) return recording.refusal();
    run->recording = *recording;
    auto rows = RecordedObservations::open(run->recording->file.path(), *motion, run->recording->description,
                                           request.geometry.press_direction);
    if (!rows) return Refusal{RefusalKind::kInvalidArgument, rows.error()};
    if (auto* friction = std::get_if<rt::FrictionTask>(&run->request.task)) {
      friction->normal_force_n = run->recording->normal_force_n;
    }
    if (auto refusal = check(run->request.task)) return *refusal;
    run->identification = make_identification(run->request.task, rows->rig_info());
    run->rows = std::move(*rows);
  } else {
    if (auto refusal = session_.unavailable()) return *refusal;
    if (auto refusal = check_rig(request.task, session_.rig_info())) return *refusal;
    if (is_held_back(request.task)) {
      return Refusal{RefusalKind::kFailedPrecondition,
                     {"the guard is latched", "guard", "", "", "fix the cause and clear it first"},
                     Reason::kGuardLatched};
    }
    if (auto refusal = check_geometry(request.geometry, session_.simulation() != nullptr)) return *refusal;
    if (const auto scene = scenes_.current()) run->usual = scene->spec.guard;
    auto reservation = scenes_.reserve("identification '" + run->id + "'");
    if (!reservation) return reservation.refusal();
    run->reservation.emplace(std::move(*reservation));
    const hal::RigInfo& rig = session_.rig_info();
    run->view.emplace(request.task, request.geometry, rig, scenes_.models().of_rig(rig),
                      biases_.zero_in_force());
    run->identification = make_identification(request.task, run->view->rig_info());
    if (!store_.in_memory()) {
      auto kept =
          ObservationFile::create(store_.path() + ".data/" + run->id + ".csv", rig.has_external_position);
      if (kept) {
        run->kept.emplace(std::move(*kept));
      } else {
        log_warning(kept.error().text());
      }
    }
  }

  ++started_;
  IdentificationReport report;
  report.id = run->id;
  report.kind = kind;
  report.object = request.object;
  report.recording = request.recording;
  report.time_limit_s = request.time_limit_s;
  report.version = 1;
  reports_.push_front(std::move(report));
  if (reports_.size() > kKept) reports_.pop_back();
  cancel_.store(false);
  if (thread_.joinable()) thread_.join();  // the last one has reported its end and only leaves
  const std::string id = run->id;
  thread_ = std::thread([this, run = std::move(run)] { perform(*run); });
  log_info("identification '" + id + "' begins");
  return id;
}

void IdentificationRunner::perform(Run& run) {
  const Ended ended = run.rows ? listen_to_recording(run) : listen_to_rig(run);
  conclude(run, ended);
}

bool IdentificationRunner::is_held_back(const IdentificationTask& task) {
  const rt::TickRecord last = hub_.latest();
  if (last.guard_state != rt::GuardState::kLatched) return false;
  return renders_force(task) || last.guard_fault == rt::GuardFault::kStopped;
}

void IdentificationRunner::publish(const Run& run, const rt::IdentificationProgress& progress) {
  {
    const std::lock_guard lock(mutex_);
    IdentificationReport& report = reports_.front();
    report.progress = progress;
    report.instruction = run.instruction;
    ++report.version;
  }
  changed_.notify_all();
}

std::optional<Refusal> IdentificationRunner::arrange(Run& run, const rt::MotionRequest& request) {
  run.instruction = request.words;
  const Caller no_caller;
  auto scene = requested_scene(request, session_.rig_info());
  if (scene) {
    scene->guard.loop_gap_ms = run.usual.loop_gap_ms;
    if (run.usual.sensor_stale_after_ms > 0.0) {
      scene->guard.sensor_stale_after_ms = run.usual.sensor_stale_after_ms;
    }
    // A scene that is exchanged has to see the tool free first: not in the middle of a person's press.
    const bool hand_is_simulated = session_.simulation() != nullptr;
    if (hand_is_simulated || !run.rendered || !renders_the_same(*run.rendered, *scene)) {
      const auto loaded = run.reservation->load(*scene, no_caller);
      if (!loaded) return loaded.refusal();
    }
    run.rendered = scene;
  } else if (run.device != request.device) {
    const auto unloaded = run.reservation->unload(no_caller);
    if (!unloaded) return unloaded.refusal();
    run.rendered.reset();
  }
  run.device = request.device;
  return std::nullopt;
}

IdentificationRunner::Ended IdentificationRunner::listen_to_rig(Run& run) {
  const auto fault = [](const Refusal& refusal) { return Ended{Ending::kFault, refusal.error}; };
  const bool needs_sensor = uses_sensor(run.request.task);
  if (needs_sensor) {
    // Before the scene lets go of it.
    auto sensor = session_.claim_sensor();
    if (!sensor) return {Ending::kFault, sensor.error()};
    run.sensor.emplace(std::move(*sensor));
  }
  if (uses_instrument(run.request.task)) {
    if (auto error = run.instrument.open(session_.rig())) return {Ending::kFault, *error};
  }
  SampleWatch samples(needs_bias(run.request.task));
  if (const auto unloaded = run.reservation->unload(Caller{}); !unloaded) return fault(unloaded.refusal());
  rt::Engine& engine = session_.engine();
  struct Observing {
    rt::Engine& engine;
    explicit Observing(rt::Engine& e) : engine(e) { engine.observe(true); }
    ~Observing() { engine.observe(false); }
  } const observing(engine);

  rt::Observation observation;
  std::int64_t began_ns = -1;
  double now_s = 0.0;
  double next_request_s = 0.0;
  int idle_requests = 0;
  auto next_report = Clock::now();
  auto last_heard = Clock::now();
  for (;;) {
    bool any = false;
    while (now_s < next_request_s && engine.pop_observation(observation)) {
      any = true;
      if (began_ns < 0) began_ns = observation.sample.time_ns;
      now_s = 1e-9 * static_cast<double>(observation.sample.time_ns - began_ns);
      if (needs_sensor) {
        if (auto error = samples.look(observation.sample, now_s)) return {Ending::kFault, *error};
      }
      run.identification->add(run.view->see(observation));
      if (run.kept) run.kept->add(observation);
      // Who searches a limit finds it: what is rendered on an object may have to end at once.
      if (run.device == rt::MotionRequest::Device::kModulation &&
          observation.sample.tick % kTicksBetweenLooks == 0 &&
          run.identification->next_request().device == rt::MotionRequest::Device::kNothing) {
        next_request_s = now_s;
      }
      if (now_s >= run.request.time_limit_s) break;
    }
    if (cancel_.load()) return {Ending::kCancelled, {}};
    if (session_.unavailable()) return {Ending::kFault, session_.unavailable()->error};
    if (is_held_back(run.request.task)) {
      return {Ending::kFault, hal::Error{"the guard latched", "guard", "", "",
                                         "see in 'hapticctl status' why; clear it and start again"}};
    }
    const auto now = Clock::now();
    const bool ask = now_s >= next_request_s;
    if (ask || now >= next_report) {
      const rt::IdentificationProgress progress = run.identification->progress();
      publish(run, progress);
      next_report = now + kReportEvery;
      if (progress.converged) return {Ending::kConverged, {}};
    }
    if (now_s >= run.request.time_limit_s) return {Ending::kNoMoreData, {}};
    if (ask) {
      const rt::MotionRequest request = run.identification->next_request();
      // Rest without an end, twice: nothing more is wanted.
      const bool idle = request.motion == rt::MotionRequest::Motion::kRest && request.hold_s <= 0.0;
      idle_requests = idle ? idle_requests + 1 : 0;
      if (idle_requests >= 2) return {Ending::kNoMoreData, {}};
      if (auto refusal = arrange(run, request)) return fault(*refusal);
      next_request_s = now_s + kAskUserEveryS;
      if (sim::SimulatedRig* simulation = session_.simulation()) {
        const SimulatedMotion motion = simulated_motion(request);
        if (auto error = simulation->set_program(motion.program)) return {Ending::kFault, *error};
        next_request_s = now_s + motion.duration_s;
      }
    }
    if (any) {
      last_heard = Clock::now();
    } else {
      if (Clock::now() - last_heard > kMaxSilence) {
        return {Ending::kFault, hal::Error{"the loop has stopped: no tick for 5 s", "loop", "", "",
                                           "see in 'hapticctl doctor' what holds it back"}};
      }
      std::this_thread::sleep_for(kPollInterval);
    }
  }
}

IdentificationRunner::Ended IdentificationRunner::listen_to_recording(Run& run) {
  std::size_t rows = 0;
  bool cancelled = false;
  auto next_report = Clock::now();
  auto problem = run.rows->read([&](const rt::Observation& observation) {
    run.identification->add(observation);
    if (++rows % kRowsBetweenLooks != 0) return true;
    if (Clock::now() >= next_report) {
      publish(run, run.identification->progress());
      next_report = Clock::now() + kReportEvery;
    }
    cancelled = cancel_.load();
    return !cancelled;
  });
  if (problem) return {Ending::kFault, std::move(problem)};
  return {cancelled ? Ending::kCancelled : Ending::kNoMoreData, {}};
}

void IdentificationRunner::conclude(Run& run, const Ended& ended) {
  rt::IdentificationProgress progress = run.identification->progress();
  std::optional<hal::Error> problem = ended.problem;
  std::string hash;
  bool converged = false;
  if (auto model = run.identification->finish()) {
    progress.parameters = model->parameters;  // what the end refined
    progress.residual = model->residual;
    converged = model->converged && ended.ending != Ending::kFault;
    model->converged = converged;
    model->object = run.request.object;
    if (run.recording) {
      model->data_reference = run.recording->description.name + ", sha256 " + run.recording->sha256;
      const bool about_rig = !is_about_object(run.request.task);
      if (about_rig && run.request.adopt) {
        // A recording does not say of which rig it is; to adopt its model is to say that it is of this one.
        model->device = session_.rig_info().device.model;
        model->sensor = session_.rig_info().sensor.model;
      } else if (about_rig) {
        progress.remarks.push_back(
            "the model belongs to no device, and scenes do not use it: adopt it where the recording is of "
            "this "
            "rig");
      }
    } else {
      const hal::RigInfo& rig = session_.rig_info();
      if (auto* tool = std::get_if<rt::ToolModel>(&model->content)) {
        tool->found_under_bias = biases_.zero_in_force().identity;
      }
      if (!run.view->remark().empty()) model->procedure += "; " + run.view->remark();
      model->device = rig.device.model;
      model->sensor = rig.sensor.model;
      model->data_reference = fmt::format("{:.1f} s on rig '{}'", progress.duration_s, rig.name);
      if (run.kept) {
        if (auto kept = run.kept->finish()) {
          model->data_reference += ": " + *kept;
        } else {
          log_warning(kept.error().text());
        }
      }
    }
    if (auto error = rt::check(*model)) {
      if (!problem) problem = std::move(error);
    } else if (auto stored = store_.add(*model, Clock::now() + kStoreTimeout)) {
      hash = stored->hash;
      if (converged && run.request.adopt) {
        if (auto tagged = store_.tag(hash, kCurrentTag, Clock::now() + kStoreTimeout); !tagged && !problem)
          problem = tagged.refusal().error;
      }
    } else if (!problem) {
      problem = stored.refusal().error;
    }
  } else if (!problem) {
    problem = model.error();
  }

  if (run.kept && hash.empty()) run.kept->discard();
  if (run.reservation) {
    // What was in force before comes back, afresh.
    if (sim::SimulatedRig* simulation = session_.simulation()) {
      const sim::HandProgram rest;
      (void)simulation->set_program(rest);
    }
    const auto restored = run.reservation->restore(Caller{});
    if (!restored && !problem && !session_.stopping()) problem = restored.refusal().error;
    if (restored && restored->scene) {
      progress.remarks.push_back(fmt::format("scene '{}' was loaded again, with the target that was in force",
                                             restored->scene->spec.name));
    }
    run.reservation.reset();
    run.sensor.reset();
    run.instrument.close();
  }

  IdentificationState state = IdentificationState::kFailed;
  if (ended.ending == Ending::kCancelled) {
    state = IdentificationState::kCancelled;
  } else if (ended.ending != Ending::kFault && !hash.empty()) {
    state = converged ? IdentificationState::kConverged : IdentificationState::kPartial;
  }
  IdentificationReport report;
  {
    const std::lock_guard lock(mutex_);
    IdentificationReport& last = reports_.front();
    last.progress = std::move(progress);
    last.instruction.clear();
    last.model = hash;
    last.problem = problem;
    last.state = state;
    ++last.version;
    report = last;
  }
  changed_.notify_all();
  const std::int64_t now_s =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const auto recorded =
      store_.record_identification({report.id, report.kind, report.object, text_of(state), now_s, hash,
                                    problem ? problem->text() : std::string(), ""},
                                   Clock::now() + kStoreTimeout);
  if (!recorded) log_warning(recorded.refusal().error.text());
  log_info("identification '" + report.id + "' is over: " + text_of(state) +
           (hash.empty() ? "" : ", model " + hash.substr(0, 12)) +
           (problem ? "; " + problem->text() : std::string()));
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
  std::unique_lock lock(mutex_);
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
  constexpr std::chrono::milliseconds kSlice{50};
  while (found != nullptr && found->version <= newer_than && found->state == IdentificationState::kRunning &&
         Clock::now() < caller.deadline && !caller.cancelled() && !shut_down_) {
    changed_.wait_for(lock, kSlice);
    found = find_locked(wanted);
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
    const std::lock_guard lock(mutex_);
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

std::vector<IdentificationReport> IdentificationRunner::list() const {
  const std::lock_guard lock(mutex_);
  return {reports_.begin(), reports_.end()};
}

}  // namespace hapticd::server
