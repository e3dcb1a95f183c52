#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "rt/record/tick_record.h"
#include "server/identification/palpation/requested_scene.h"
#include "server/identification/palpation/simulated_palpator.h"
#include "server/identification/run/identification_run.h"
#include "server/identification/run/sample_monitor.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kReportEvery{100};
constexpr std::chrono::milliseconds kPollInterval{1};
constexpr std::chrono::seconds kMaxSilence{5};
/// Interval at which a person is asked what should happen next; the simulated hand is asked once it has done
/// it: a person goes on without waiting, and the device has to follow at once.
constexpr double kAskUserEveryS = 0.1;
constexpr std::size_t kRowsBetweenLooks = 4096;
constexpr std::uint64_t kTicksBetweenLooks = 5;

}  // namespace

bool IdentificationRunner::is_held_back(const IdentificationTask& task) {
  const rt::TickRecord last = hub_.latest();
  if (last.guard_state != rt::GuardState::kLatched) return false;
  return renders_force(task) || last.guard_fault == rt::GuardFault::kStopped;
}

std::optional<Refusal> IdentificationRunner::arrange(Run& run, const identification::MotionRequest& request) {
  run.instruction = request.words;
  const Caller no_caller;
  auto scene = requested_scene(request, session_.rig_info());
  if (scene) {
    scene->guard.loop_gap_ms = run.usual.loop_gap_ms;
    if (run.usual.sensor_stale_after_ms > 0.0) {
      scene->guard.sensor_stale_after_ms = run.usual.sensor_stale_after_ms;
    }
    // A scene that is to be exchanged has to see the tool free first: not in the middle of a person's press.
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
  SampleMonitor samples(needs_bias(run.request.task));
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
      // An identification that searches a limit finds it: what is rendered on an object may have to end at
      // once.
      if (run.device == identification::MotionRequest::Device::kModulation &&
          observation.sample.tick % kTicksBetweenLooks == 0 &&
          run.identification->next_request().device == identification::MotionRequest::Device::kNothing) {
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
      const identification::IdentificationProgress progress = run.identification->progress();
      publish(run, progress);
      next_report = now + kReportEvery;
      if (progress.converged) return {Ending::kConverged, {}};
    }
    if (now_s >= run.request.time_limit_s) return {Ending::kNoMoreData, {}};
    if (ask) {
      const identification::MotionRequest request = run.identification->next_request();
      // Rest without an end, twice: nothing more is wanted.
      const bool idle =
          request.motion == identification::MotionRequest::Motion::kRest && request.hold_s <= 0.0;
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

}  // namespace hapticd::server
