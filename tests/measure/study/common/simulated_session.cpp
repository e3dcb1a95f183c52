#include "tests/measure/study/common/simulated_session.h"

#include <chrono>
#include <memory>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "server/identification/palpation/requested_scene.h"
#include "server/identification/palpation/simulated_palpator.h"
#include "tests/measure/study/common/plant.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

using test::demand;
using test::value_of;

SessionResult run_session(identification::Identification& identification, const sim::SimulationConfig& config,
                          double limit_s,
                          const std::function<void(const rt::Observation&, const hal::TruthSample&)>& watch) {
  const std::unique_ptr<sim::SimulatedRig> rig = value_of(create_rig(config));
  rt::GuardLimits limits;
  limits.max_force_n = rig->info().device.max_force_n;
  limits.max_force_rate_n_per_s = 1e6;
  limits.sensor_stale_after_ms = 0.0;
  rt::Renderer renderer(limits, config.rate_hz);
  std::unique_ptr<rt::Pipeline> pipeline;

  SessionResult result;
  double next_request_s = 0.0;
  identification::MotionRequest request;
  int idle_requests = 0;
  rt::Observation observation;
  rt::TickRecord record;
  hal::TruthSample truth;
  using Clock = std::chrono::steady_clock;
  Clock::duration computation{};
  for (std::int64_t tick = 0;; ++tick) {
    if (result.duration_s >= next_request_s) {
      result.progress = identification.progress();
      if (result.progress.converged && result.converged_s < 0.0) result.converged_s = result.duration_s;
      if (result.progress.converged || result.duration_s >= limit_s) break;
      request = identification.next_request();
      // Rest without an end in sight, twice: nothing more is wanted.
      const bool idle =
          request.motion == identification::MotionRequest::Motion::kRest && request.hold_s <= 0.0;
      idle_requests = idle ? idle_requests + 1 : 0;
      if (idle_requests >= 2) break;
      const server::SimulatedMotion motion = server::simulated_motion(request);
      demand(rig->set_program(motion.program));
      const auto scene = server::requested_scene(request, rig->info());
      std::unique_ptr<rt::Pipeline> next;
      rt::GuardLimits guard = limits;
      if (scene) {
        const rt::SceneSpec resolved = value_of(rt::resolve(*scene, rig->info()));
        next = value_of(rt::compose(resolved, rig->info()));
        guard = resolved.guard;
      }
      renderer.exchange(next.get(), guard);
      pipeline = std::move(next);
      next_request_s = result.duration_s + motion.duration_s;
    }
    rig->read(observation.sample);
    observation.device_command_n = renderer.tick(observation.sample, record).force_n;
    rig->write({observation.device_command_n});
    observation.has_external_position = rig->external_position(observation.external_position_mm);
    rig->truth(truth);
    if (watch) watch(observation, truth);
    const auto before = Clock::now();
    identification.add(observation);
    computation += Clock::now() - before;
    result.duration_s = 1e-9 * static_cast<double>(observation.sample.time_ns);
    // What renders on an object may have to end at once: the one who searches a limit finds it.
    if (request.device == identification::MotionRequest::Device::kModulation && tick % 5 == 0 &&
        identification.next_request().device == identification::MotionRequest::Device::kNothing) {
      next_request_s = result.duration_s;
    }
  }
  result.computation_s = std::chrono::duration<double>(computation).count();
  return result;
}

}  // namespace hapticd::study
