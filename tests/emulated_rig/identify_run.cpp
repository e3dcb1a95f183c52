#include "tests/emulated_rig/identify_run.h"

#include "server/identification/palpation/requested_scene.h"
#include "server/identification/palpation/simulated_palpator.h"
#include "tests/support/ticks/lateness.h"
#include "tests/support/turn.h"

namespace hapticd::test {

namespace {

constexpr double kDriftNPerS = 1e-3;
constexpr double kTickS = 1e-3;
// Bound for a machine that others use too.
constexpr double kLateSensorMs = 1000.0;
constexpr double kLateLoopMs = 1000.0;
constexpr std::uint64_t kTicksBetweenLooks = 5;

}  // namespace

RunConfig rig_for_identification(const sim::SimulationConfig& simulation) {
  RunConfig config;
  config.simulation = simulation;
  config.simulation.condition_values["sensor_drift_n_per_s"] = kDriftNPerS;
  config.scene.name = "far_wall";
  config.scene.kind = rt::SceneKind::kWall;
  config.scene.wall_position_mm = 500.0;
  config.scene.target = rt::linear_target(0.5);
  config.scene.guard.sensor_stale_after_ms = 0.0;
  config.late_us = lateness_us(6'000, {{500, 500.0}, {3'000, 5'000.0}});
  return config;
}

IdentifyRunResult identify_on(Run& run, identification::Identification& identification,
                              const IdentifyRunConfig& config) {
  // Biased with the tool as the world holds it, its weight along the rig's -z.
  const hal::Vector3 down = turned(inverse(run.turn()), {0.0, 0.0, -1.0});
  identification::PressFrame frame(config.geometry, rt::ToolLoad(config.tool_mass_g, down),
                                   config.tool_mass_g, run.rig_info());
  run.keep_records(false);
  rt::Engine& engine = run.engine();
  engine.observe(true);
  IdentifyRunResult result;
  identification::MotionRequest request;
  double next_request_s = 0.0;
  int idle_requests = 0;
  std::int64_t began_ns = -1;
  rt::Observation observation;
  for (bool over = false; !over;) {
    while (result.duration_s < next_request_s && engine.pop_observation(observation)) {
      if (began_ns < 0) began_ns = observation.sample.time_ns;
      result.duration_s = 1e-9 * static_cast<double>(observation.sample.time_ns - began_ns);
      if (observation.has_external_position) ++result.external_readings;
      if (config.seen_as == SeenAs::kRaw) {
        identification.add(observation);
      } else {
        frame.follow_zero(observation.sample);
        identification.add(config.seen_as == SeenAs::kUpright ? frame.upright(observation)
                                                              : frame.seated(observation));
      }
      // What renders on an object may have to end at once: a search for a limit finds it.
      if (request.device == identification::MotionRequest::Device::kModulation &&
          observation.sample.tick % kTicksBetweenLooks == 0 &&
          identification.next_request().device == identification::MotionRequest::Device::kNothing) {
        next_request_s = result.duration_s;
      }
    }
    if (result.duration_s < next_request_s) {
      run.pass(kTickS);
      continue;
    }
    result.progress = identification.progress();
    if (!run.records().empty() && run.last().guard_state == rt::GuardState::kLatched)
      result.latched = run.last().guard_fault;
    if (result.progress.converged) result.converged_s = result.duration_s;
    const identification::MotionRequest::Device before = request.device;
    request = identification.next_request();
    const bool idle = request.motion == identification::MotionRequest::Motion::kRest && request.hold_s <= 0.0;
    idle_requests = idle ? idle_requests + 1 : 0;
    over = result.progress.converged || result.duration_s >= config.limit_s || idle_requests >= 2;
    if (over) break;
    if (auto scene = server::requested_scene(request, run.rig_info())) {
      scene->guard.sensor_stale_after_ms = kLateSensorMs;
      scene->guard.loop_gap_ms = kLateLoopMs;
      run.exchange(&*scene);
    } else if (before != identification::MotionRequest::Device::kNothing) {
      run.exchange(nullptr);
    }
    const server::SimulatedMotion motion = server::simulated_motion(request);
    run.set_hand(motion.program);
    next_request_s = result.duration_s + motion.duration_s;
  }
  engine.observe(false);
  return result;
}

}  // namespace hapticd::test
