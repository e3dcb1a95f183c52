#include "server/scene_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "rt/scene/compose.h"
#include "rt/scene/tick_record.h"
#include "server/log.h"
#include "server/scene_file.h"
#include "server/suggestion.h"
#include "server/text_library.h"

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

/// How far a part may be trusted: its fit where it has one, and where it comes from.
std::string remark_on(const std::string& need, const rt::ObjectModel& model) {
  std::string fit;
  if (model.creep && need.starts_with("creep")) {
    fit = fmt::format("rms error {:.3g} %", 100.0 * model.creep->relative_error);
  } else if (model.hunt_crossley && need.starts_with("Hunt-Crossley")) {
    fit = fmt::format("rms error {:.3g} %", 100.0 * model.hunt_crossley->relative_error);
  }
  if (model.identified_on.empty()) return fit;
  return fit + (fit.empty() ? "" : "; ") + "identified on " + model.identified_on;
}

}  // namespace

SceneHost::SceneHost(Session& session, SceneLibrary scenes, ModelLibrary models)
    : session_(session), library_(std::move(scenes)), models_(std::move(models)) {}

Outcome<ResolvedScene> SceneHost::resolve(const SceneSource& source) const {
  const bool by_name = source.kind == SceneSource::Kind::kName;
  auto spec = by_name ? library_.find(source.text) : parse_scene(source.text, "scene text");
  if (!spec) {
    const bool unknown = by_name && !library_.contains(source.text);
    return Refusal{unknown ? RefusalKind::kNotFound : RefusalKind::kInvalidArgument, spec.error()};
  }
  if (!source.object_model.empty()) {
    if (auto error = check_name("model", source.object_model, "object_model")) {
      return Refusal{RefusalKind::kInvalidArgument, *error};
    }
    spec->object_model = source.object_model;
  }
  auto resolved = rt::resolve(*spec, session_.rig_info());
  if (!resolved) return Refusal{RefusalKind::kInvalidArgument, resolved.error()};

  ResolvedScene scene{*resolved, rt::outline(*resolved), {}, {}, {}};
  if (!scene.outline.models.empty()) find_model(scene);
  scene.outline.channels |= rt::channel::kSample | rt::channel::kGuard | rt::channel::kTiming;
  if (session_.rig_info().has_truth) scene.outline.channels |= rt::channel::kTruth;
  return scene;
}

void SceneHost::find_model(ResolvedScene& scene) const {
  if (auto model = models_.find(scene.spec.object_model)) {
    scene.model = std::move(*model);
  } else {
    scene.model_problem = model.error();
  }
  const auto missing = rt::needed_models(scene.spec, scene.model ? &*scene.model : nullptr);
  std::string problem;
  if (scene.model_problem) {
    problem = models_.contains(scene.spec.object_model)
                  ? scene.model_problem->text()
                  : "there is no such model; " +
                        did_you_mean(scene.spec.object_model, models_.names(), "identify the object");
  }
  for (const std::string& name : scene.outline.models) {
    const bool available = std::find(missing.begin(), missing.end(), name) == missing.end();
    std::string remark = !scene.model ? problem
                         : available  ? remark_on(name, *scene.model)
                                      : "the model has no such part";
    scene.needs.push_back({name, available, std::move(remark)});
  }
}

Outcome<std::unique_ptr<rt::Pipeline>> SceneHost::compose(const ResolvedScene& scene) const {
  const std::string& wanted = scene.spec.object_model;
  // A file that is there but cannot be used is told by its own mistake.
  if (scene.model_problem && models_.contains(wanted)) {
    return Refusal{RefusalKind::kFailedPrecondition, *scene.model_problem};
  }
  auto pipeline = rt::compose(scene.spec, session_.rig_info(), scene.model ? &*scene.model : nullptr);
  if (pipeline) return std::move(*pipeline);
  hal::Error error = pipeline.error();
  if (std::any_of(scene.needs.begin(), scene.needs.end(),
                  [](const ModelNeed& need) { return !need.available; })) {
    std::vector<std::string> able;
    for (const ModelLibrary::Entry& entry : models_.list()) {
      if (entry.model && rt::needed_models(scene.spec, &*entry.model).empty()) able.push_back(entry.name);
    }
    error.limit = comma_separated(able);
    if (!scene.model) error.remedy = did_you_mean(wanted, able, error.remedy);
  }
  return Refusal{RefusalKind::kFailedPrecondition, error};
}

std::optional<hal::Error> SceneHost::preload(const std::string& name) {
  auto scene = resolve({SceneSource::Kind::kName, name, {}});
  if (!scene) return scene.refusal().error;
  auto pipeline = compose(*scene);
  if (!pipeline) return pipeline.refusal().error;
  session_.engine().preload(pipeline->get(), scene->spec.guard);
  live_ = std::move(*pipeline);
  const std::lock_guard lock(current_mutex_);
  current_ = std::make_shared<const ResolvedScene>(std::move(*scene));
  return std::nullopt;
}

Outcome<SceneHost::Loaded> SceneHost::load(const SceneSource& source, const Caller& caller) {
  auto scene = resolve(source);
  if (!scene) return scene.refusal();
  if (auto refusal = reserved()) return *refusal;
  return load_resolved(std::move(*scene), caller);
}

Outcome<SceneHost::Loaded> SceneHost::load_resolved(ResolvedScene scene, const Caller& caller) {
  auto pipeline = compose(scene);
  if (!pipeline) return pipeline.refusal();
  const rt::GuardLimits guard = scene.spec.guard;
  return exchange(std::move(*pipeline), guard, std::make_shared<const ResolvedScene>(std::move(scene)),
                  caller);
}

Outcome<SceneHost::Loaded> SceneHost::unload(const Caller& caller) {
  if (auto refusal = reserved()) return *refusal;
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

std::optional<Refusal> SceneHost::reserved() const {
  const std::lock_guard lock(current_mutex_);
  if (reserved_by_.empty()) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {reserved_by_ + " is under way", "scene", "", "", "wait until it is over, or cancel it"}};
}

Outcome<SceneHost::Reservation> SceneHost::reserve(const std::string& by) {
  if (auto refusal = reserved()) return *refusal;
  {
    const std::lock_guard lock(current_mutex_);
    reserved_by_ = by;
  }
  return Reservation(*this);
}

SceneHost::Reservation::~Reservation() {
  if (host_ == nullptr) return;
  const std::lock_guard lock(host_->current_mutex_);
  host_->reserved_by_.clear();
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::load(const rt::SceneSpec& spec, const Caller& caller) {
  auto resolved = rt::resolve(spec, host_->session_.rig_info());
  if (!resolved) return Refusal{RefusalKind::kInternal, resolved.error()};
  ResolvedScene scene;
  scene.spec = *resolved;
  scene.outline = rt::outline(*resolved);
  return host_->load_resolved(std::move(scene), caller);
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::unload(const Caller& caller) {
  return host_->exchange(nullptr, idle_limits(host_->session_.rig_info().device), nullptr, caller);
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::restore(const Caller& caller) {
  if (!before_) return unload(caller);
  return host_->load_resolved(*before_, caller);
}

SceneHost::Hold SceneHost::hold(Caller::Clock::time_point until) {
  Hold hold;
  const std::unique_lock gate(gate_, until);
  if (gate) hold.lock_ = std::shared_lock(exchange_, until);
  return hold;
}

}  // namespace hapticd::server
