#include "server/scene_host.h"

#include <utility>

#include "rt/scene/compose.h"
#include "rt/scene/tick_record.h"
#include "server/log.h"
#include "server/scene_file.h"

namespace hapticd::server {

namespace {

/// Bounds while no scene is loaded: nothing is wanted of the device, and a force still standing may fall.
rt::GuardLimits idle_limits(const hal::DeviceInfo& device) {
  rt::GuardLimits limits;
  limits.max_force_n = device.max_force_n;
  limits.max_force_rate_n_per_s = device.max_force_n / 0.005;
  limits.sensor_stale_after_ms = 0.0;
  return limits;
}

Refusal busy() {
  return {
      RefusalKind::kDeadlineExceeded,
      {"another scene is being loaded or a target is about to take effect", "scene", "", "", "try again"}};
}

}  // namespace

SceneHost::SceneHost(Session& session, SceneLibrary library)
    : session_(session), library_(std::move(library)) {}

Outcome<ResolvedScene> SceneHost::resolve(const SceneSource& source) const {
  const bool by_name = source.kind == SceneSource::Kind::kName;
  auto spec = by_name ? library_.find(source.text) : parse_scene(source.text, "scene text");
  if (!spec) {
    const bool unknown = by_name && !library_.contains(source.text);
    return Refusal{unknown ? RefusalKind::kNotFound : RefusalKind::kInvalidArgument, spec.error()};
  }
  auto resolved = rt::resolve(*spec, session_.rig_info());
  if (!resolved) return Refusal{RefusalKind::kInvalidArgument, resolved.error()};

  ResolvedScene scene{*resolved, rt::outline(*resolved)};
  scene.outline.channels |= rt::channel::kSample | rt::channel::kGuard | rt::channel::kTiming;
  if (session_.rig_info().has_truth) scene.outline.channels |= rt::channel::kTruth;
  return scene;
}

std::optional<hal::Error> SceneHost::preload(const std::string& name) {
  auto scene = resolve({SceneSource::Kind::kName, name});
  if (!scene) return scene.refusal().error;
  auto pipeline = rt::compose(scene->spec, session_.rig_info());
  if (!pipeline) return pipeline.error();
  session_.engine().preload(pipeline->get(), scene->spec.guard);
  live_ = std::move(*pipeline);
  const std::lock_guard lock(current_mutex_);
  current_ = std::make_shared<const ResolvedScene>(std::move(*scene));
  return std::nullopt;
}

Outcome<SceneHost::Loaded> SceneHost::load(const SceneSource& source, const Caller& caller) {
  auto scene = resolve(source);
  if (!scene) return scene.refusal();
  auto pipeline = rt::compose(scene->spec, session_.rig_info());
  if (!pipeline) return Refusal{RefusalKind::kFailedPrecondition, pipeline.error()};
  const rt::GuardLimits guard = scene->spec.guard;
  return exchange(std::move(*pipeline), guard, std::make_shared<const ResolvedScene>(std::move(*scene)),
                  caller);
}

Outcome<SceneHost::Loaded> SceneHost::unload(const Caller& caller) {
  return exchange(nullptr, idle_limits(session_.rig_info().device), nullptr, caller);
}

Outcome<SceneHost::Loaded> SceneHost::exchange(std::unique_ptr<rt::Pipeline> next,
                                               const rt::GuardLimits& guard,
                                               std::shared_ptr<const ResolvedScene> scene,
                                               const Caller& caller) {
  if (auto refusal = session_.unavailable()) return *refusal;
  const auto until = caller.until(kDefaultPatience);
  const std::unique_lock gate(gate_, until);
  if (!gate) return busy();
  const std::unique_lock exclusive(exchange_, until);
  if (!exclusive) return busy();

  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kExchangeScene;
  command.pipeline = next.get();
  command.guard = guard;
  const auto outcome = session_.execute(command, caller, kDefaultPatience);
  if (!outcome) return outcome.refusal();

  live_ = std::move(next);  // deletes the retired one, here and not in the loop
  {
    const std::lock_guard lock(current_mutex_);
    current_ = scene;
  }
  log_info(scene ? "scene '" + scene->spec.name + "' loaded" : std::string("scene unloaded"));
  return Loaded{std::move(scene), outcome->tick};
}

std::shared_ptr<const ResolvedScene> SceneHost::current() const {
  const std::lock_guard lock(current_mutex_);
  return current_;
}

SceneHost::Hold SceneHost::hold(Caller::Clock::time_point until) {
  Hold hold;
  const std::unique_lock gate(gate_, until);
  if (gate) hold.lock_ = std::shared_lock(exchange_, until);
  return hold;
}

}  // namespace hapticd::server
