#include "server/scene/scene_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "rt/record/tick_record.h"
#include "rt/scene/compose.h"
#include "rt/target/largest_target.h"
#include "server/process/log.h"
#include "server/scene/scene_file.h"
#include "server/scene/scene_models.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

Refusal busy() {
  return {
      RefusalKind::kDeadlineExceeded,
      {"another scene is being loaded or a target is about to take effect", "scene", "", "", "try again"}};
}

Refusal in_contact() {
  return {RefusalKind::kDeadlineExceeded,
          {"the tip is in contact: a model is exchanged out of contact only", "scene", "", "",
           "lift the tool while the call waits, or unload the scene first"}};
}

bool uses_sensor(const ResolvedScene* scene) {
  if (scene == nullptr) return false;
  const auto& hardware = scene->outline.hardware;
  return std::find(hardware.begin(), hardware.end(), "force sensor") != hardware.end();
}

/// A waiting exchange ends this long before the caller's deadline, so that the reason still arrives.
constexpr std::chrono::milliseconds kReplyTime{200};
constexpr std::chrono::seconds kMaxWaitForFree{60};
/// An exchange is handed to the loop for this time; targets may pass in between.
constexpr std::chrono::milliseconds kSlice{100};
constexpr std::chrono::milliseconds kPollInterval{2};

/// How reliable a part is: its fit if it has one, its source, and warnings.
std::string remark_on(const std::string& need, const FoundModel& found, const rt::SceneSpec& scene,
                      const hal::RigInfo& rig) {
  const rt::ObjectModel& model = found.model;
  std::vector<std::string> said;
  const FoundModel::Origin* origin = &found.rod_friction;
  const auto fit = [&said](double relative_error) {
    said.push_back(fmt::format("rms error {:.3g} %", 100.0 * relative_error));
  };
  if (model.creep && need.starts_with("creep")) {
    fit(model.creep->relative_error);
    origin = &found.creep;
  } else if (model.hunt_crossley && need.starts_with("Hunt-Crossley")) {
    fit(model.hunt_crossley->relative_error);
    origin = &found.hunt_crossley;
  }
  if (const StoredModel* stored = origin->get()) {
    said.push_back("stored model " + stored->short_hash());
    if (!stored->model.procedure.empty()) said.push_back(stored->model.procedure);
    for (std::string& caution : cautions(*stored, scene, rig)) said.push_back(std::move(caution));
  } else if (!model.identified_on.empty()) {
    said.push_back(found.stored().empty() ? "identified on " + model.identified_on : "from the model file");
  }
  return fmt::format("{}", fmt::join(said, "; "));
}

/// The default limit of targets: on a soft object less than the device could hold. The stiffness with which
/// the scene itself starts is always allowed.
void limit_to_object(ResolvedScene& scene) {
  const auto own_n_per_mm = rt::stiffness_n_per_mm(scene.model->model, rt::kFirmPressN);
  if (!own_n_per_mm) return;
  const double asked = rt::greatest_stiffness_n_per_mm(scene.spec.target, rt::kDeepestTargetMm);
  double& largest = scene.spec.max_target_stiffness_n_per_mm;
  largest = std::max(asked, std::min(largest, rt::kMaxTargetOverObject * *own_n_per_mm));
}

/// Friction of a ball bearing is used where it was identified; no scene needs it.
bool rolls_on_an_object(const rt::SceneSpec& scene) {
  return scene.kind == rt::SceneKind::kExplore && scene.tip == rt::Tip::kBallBearing &&
         scene.object_model != "none";
}

void say_bearing_friction(ResolvedScene& scene, const hal::RigInfo& rig) {
  if (!scene.model || !scene.model->model.bearing_friction) return;
  std::string remark =
      fmt::format("friction of the ball bearing: {:.3g}, ", scene.model->model.bearing_friction->kinetic);
  if (const StoredModel* stored = scene.model->bearing_friction.get()) {
    remark += "from stored model " + stored->short_hash();
    for (const std::string& caution : cautions(*stored, scene.spec, rig)) remark += "; " + caution;
    scene.stored.push_back(stored->hash);
  } else {
    remark += "from the model file";
  }
  scene.remarks.push_back(std::move(remark));
}

}  // namespace

SceneHost::SceneHost(Session& session, SceneLibrary scenes, ModelLibrary models,
                     const GuardCeilings& ceilings)
    : session_(session), ceilings_(ceilings), library_(std::move(scenes)), models_(std::move(models)) {}

/// Limits while no scene is loaded: no force is requested, and a remaining force may fall.
rt::GuardLimits SceneHost::idle_limits() const {
  const hal::DeviceInfo& device = session_.rig_info().device;
  rt::GuardLimits limits;
  limits.max_force_n = device.max_force_n;
  limits.max_force_rate_n_per_s = device.max_force_n / 0.005;
  limits = within_ceilings(ceilings_, device, limits);
  limits.sensor_stale_after_ms = 0.0;
  return limits;
}

Outcome<rt::SceneSpec> SceneHost::resolve_within_ceilings(rt::SceneSpec spec,
                                                          std::vector<std::string>& remarks) const {
  const hal::RigInfo& rig = session_.rig_info();
  fill_from_ceilings(ceilings_, rig.device, spec, remarks);
  auto resolved = rt::resolve(std::move(spec), rig);
  if (!resolved) return Refusal{RefusalKind::kInvalidArgument, resolved.error()};
  if (auto error = check_ceilings(ceilings_, rig.device, *resolved)) {
    return Refusal{RefusalKind::kOutOfRange, std::move(*error)};
  }
  return std::move(*resolved);
}

Outcome<ResolvedScene> SceneHost::resolve(const SceneSource& source) const {
  const bool by_name = source.kind == SceneSource::Kind::kName;
  auto spec = by_name ? library_.find(source.text) : parse_scene(source.text, "scene text");
  if (!spec) {
    const bool unknown = by_name && !library_.contains(source.text);
    return Refusal{unknown ? RefusalKind::kNotFound : RefusalKind::kInvalidArgument, spec.error()};
  }
  if (!source.object_model.empty()) {
    if (const auto name = ModelName::parse(source.object_model, "object_model"); !name) {
      return Refusal{RefusalKind::kInvalidArgument, name.error()};
    }
    spec->object_model = source.object_model;
  }
  ResolvedScene scene;
  {
    rt::SceneSpec written = *spec;
    written.object_model.clear();
    scene.written = write_scene(written);
  }
  RigModelUse of_rig = use_rig_models(models_.of_rig(session_.rig_info()), *spec, session_.rig_info(),
                                      zero_in_force_ ? zero_in_force_() : ZeroInForce{});
  std::vector<std::string> limited;
  auto resolved = resolve_within_ceilings(*spec, limited);
  if (!resolved) return resolved.refusal();

  scene.spec = std::move(*resolved);
  scene.outline = rt::outline(scene.spec);
  scene.stored = std::move(of_rig.stored);
  scene.remarks = std::move(of_rig.remarks);
  scene.remarks.insert(scene.remarks.end(), limited.begin(), limited.end());
  const bool rolls = rolls_on_an_object(scene.spec);
  if (!scene.outline.models.empty() || rolls) find_model(scene);
  if (rolls) say_bearing_friction(scene, session_.rig_info());
  const bool says = spec->max_target_stiffness_n_per_mm > 0.0;
  if (!says && scene.model && !scene.outline.models.empty()) limit_to_object(scene);
  std::sort(scene.stored.begin(), scene.stored.end());
  scene.outline.channels |= rt::channel::kSample | rt::channel::kGuard | rt::channel::kTiming;
  if (session_.rig_info().has_truth) scene.outline.channels |= rt::channel::kTruth;
  return scene;
}

void SceneHost::find_model(ResolvedScene& scene) const {
  const std::string& wanted = scene.spec.object_model;
  if (auto found = models_.find_parts(wanted)) {
    scene.model = std::move(*found);
  } else {
    scene.model_problem = found.refusal().error;
  }
  const auto missing = rt::needed_models(scene.spec, scene.object_model());
  std::string problem;
  if (scene.model_problem) {
    problem = models_.contains(wanted)
                  ? scene.model_problem->text()
                  : "there is no such model; " + did_you_mean(wanted, models_.names(), "identify the object");
  }
  for (const std::string& name : scene.outline.models) {
    const bool available = std::find(missing.begin(), missing.end(), name) == missing.end();
    std::string remark = problem;
    if (scene.model && available) {
      remark = remark_on(name, *scene.model, scene.spec, session_.rig_info());
    } else if (scene.model) {
      remark = "the model has no such part";
      if (name.starts_with("friction") && models_.has_friction_of_bearing(wanted)) {
        remark += ": its friction was identified with the ball bearing";
      }
    }
    scene.needs.push_back({name, available, std::move(remark)});
  }
  if (!scene.model) return;
  // Only the parts that the scene uses; the other laws of the object may be deleted.
  const auto uses = [&](const FoundModel::Origin& origin, std::string_view part) {
    const bool needed = std::any_of(scene.outline.models.begin(), scene.outline.models.end(),
                                    [part](const std::string& name) { return name.starts_with(part); });
    if (origin && needed) scene.stored.push_back(origin->hash);
  };
  uses(scene.model->creep, "creep");
  uses(scene.model->hunt_crossley, "Hunt-Crossley");
  uses(scene.model->rod_friction, "friction");
}

Outcome<std::unique_ptr<rt::Pipeline>> SceneHost::compose(const ResolvedScene& scene) const {
  const std::string& wanted = scene.spec.object_model;
  // What is there but cannot be used is reported by its own mistake.
  if (scene.model_problem && models_.contains(wanted)) {
    return Refusal{RefusalKind::kFailedPrecondition, *scene.model_problem};
  }
  auto pipeline = rt::compose(scene.spec, session_.rig_info(), scene.object_model());
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
    for (const ModelNeed& need : scene.needs) {
      if (!need.available && need.remark.find("ball bearing") != std::string::npos) {
        error.remedy = need.remark + "; mount that tip and say so in the scene, or identify the rod's";
      }
    }
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
  return load_resolved(std::move(*scene), caller, Right::kAnyones);
}

Outcome<SceneHost::Loaded> SceneHost::load_resolved(ResolvedScene scene, const Caller& caller, Right right) {
  auto pipeline = compose(scene);
  if (!pipeline) return pipeline.refusal();
  const rt::GuardLimits guard = scene.spec.guard;
  return exchange(std::move(*pipeline), guard, std::make_shared<const ResolvedScene>(std::move(scene)),
                  caller, right);
}

Outcome<SceneHost::Loaded> SceneHost::unload(const Caller& caller) {
  if (auto refusal = reserved()) return *refusal;
  return exchange(nullptr, idle_limits(), nullptr, caller, Right::kAnyones);
}

bool SceneHost::differs_in_models_only(const ResolvedScene* next) const {
  const auto before = current();
  if (!before || next == nullptr || next->written.empty() || before->written != next->written) return false;
  return before->stored != next->stored || !next->outline.models.empty();
}

std::optional<Refusal> SceneHost::check_stored(const ResolvedScene& scene) const {
  for (const std::string& hash : scene.stored) {
    if (models_.store() && !models_.store()->contains(hash)) {
      return Refusal{RefusalKind::kAborted,
                     {"a model was deleted while the scene was loaded", "stored model", hash, "",
                      "load the scene again"}};
    }
  }
  return std::nullopt;
}

std::optional<Refusal> SceneHost::await_free(Caller::Clock::time_point until, const Caller& caller) const {
  while (!session_.engine().free()) {
    if (auto refusal = session_.unavailable()) return refusal;
    if (caller.cancelled()) {
      return Refusal{RefusalKind::kCancelled,
                     {"the caller went away; the model is not exchanged", "scene", "", "", ""}};
    }
    if (Caller::Clock::now() >= until) return in_contact();
    std::this_thread::sleep_for(kPollInterval);
  }
  return std::nullopt;
}

Outcome<SceneHost::Loaded> SceneHost::exchange(std::unique_ptr<rt::Pipeline> next,
                                               const rt::GuardLimits& guard,
                                               std::shared_ptr<const ResolvedScene> scene,
                                               const Caller& caller, Right right) {
  // Hardware may take seconds to answer: it is opened before other calls have to wait for it.
  auto hardware = claim_hardware(scene.get());
  if (!hardware) return hardware.refusal();
  const auto until = caller.until(kDefaultTimeout);
  const auto free_until = caller.until(kMaxWaitForFree) - kReplyTime;
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kExchangeScene;
  command.pipeline = next.get();
  command.guard = guard;
  for (;;) {
    if (auto refusal = session_.unavailable()) return *refusal;
    // Contact may last long: the gate is not held while waiting, so that targets pass.
    if (differs_in_models_only(scene.get())) {
      if (auto refusal = await_free(free_until, caller)) return *refusal;
    }
    const auto timeout = std::max(until, Caller::Clock::now() + kSlice);
    const std::unique_lock gate(gate_, timeout);
    if (!gate) return busy();
    const std::unique_lock exclusive(exchange_, timeout);
    if (!exclusive) return busy();
    if (right == Right::kAnyones) {
      if (auto refusal = reserved()) return *refusal;
    }
    if (scene) {
      if (auto refusal = check_stored(*scene)) return *refusal;
    }
    command.when_free = differs_in_models_only(scene.get());
    const auto outcome = session_.execute(command, caller, command.when_free ? kSlice : kDefaultTimeout);
    if (!outcome) {
      const bool touched_again =
          command.when_free && outcome.refusal().kind == RefusalKind::kDeadlineExceeded;
      if (!touched_again) return outcome.refusal();
      if (Caller::Clock::now() >= free_until) return in_contact();
      continue;
    }

    live_ = std::move(next);  // deletes the retired one, here and not in the loop
    {
      const std::lock_guard lock(current_mutex_);
      current_ = scene;
      target_.reset();
    }
    sensor_ = std::move(*hardware);
    log_info(scene ? "scene '" + scene->spec.name + "' loaded" : std::string("scene unloaded"));
    return Loaded{std::move(scene), outcome->tick};
  }
}

std::optional<hal::Error> SceneHost::open_hardware() {
  auto hardware = claim_hardware(current().get());
  if (!hardware) return hardware.refusal().error;
  sensor_ = std::move(*hardware);
  return std::nullopt;
}

Outcome<SensorClaim> SceneHost::claim_hardware(const ResolvedScene* scene) const {
  if (scene != nullptr && !scene->spec.turntable_station.empty() && check_station_) {
    if (auto refusal = check_station_(scene->spec.turntable_station)) return *refusal;
  }
  if (!uses_sensor(scene)) return SensorClaim();
  auto claim = session_.claim_sensor();
  if (!claim) return Refusal{RefusalKind::kFailedPrecondition, claim.error()};
  return std::move(*claim);
}

bool SceneHost::uses(const std::string& hash) const {
  const auto scene = current();
  return scene && std::binary_search(scene->stored.begin(), scene->stored.end(), hash);
}

std::shared_ptr<const ResolvedScene> SceneHost::current() const {
  const std::lock_guard lock(current_mutex_);
  return current_;
}

std::optional<Refusal> SceneHost::reserved() const {
  const std::lock_guard lock(current_mutex_);
  if (reserved_by_.empty()) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {reserved_by_ + " is under way", "scene", "", "", "wait until it is over, or cancel it"},
                 Reason::kBusy};
}

Outcome<SceneHost::Reservation> SceneHost::reserve(const std::string& by) {
  if (auto refusal = reserved()) return *refusal;
  {
    const std::lock_guard lock(current_mutex_);
    reserved_by_ = by;
  }
  return Reservation(*this);
}

void SceneHost::note_target(const rt::TargetLaw& law) {
  const std::lock_guard lock(current_mutex_);
  target_ = law;
}

SceneHost::Reservation::Reservation(SceneHost& host) : host_(&host) {
  const std::lock_guard lock(host.current_mutex_);
  before_ = host.current_;
  target_ = host.target_;
}

SceneHost::Reservation::~Reservation() {
  if (host_ == nullptr) return;
  const std::lock_guard lock(host_->current_mutex_);
  host_->reserved_by_.clear();
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::load(const rt::SceneSpec& spec, const Caller& caller) {
  ResolvedScene scene;
  const auto resolved = host_->resolve_within_ceilings(spec, scene.remarks);
  if (!resolved) return Refusal{RefusalKind::kFailedPrecondition, resolved.refusal().error};
  scene.spec = *resolved;
  scene.outline = rt::outline(*resolved);
  return host_->load_resolved(std::move(scene), caller, Right::kReserved);
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::unload(const Caller& caller) {
  return host_->exchange(nullptr, host_->idle_limits(), nullptr, caller, Right::kReserved);
}

Outcome<SceneHost::Loaded> SceneHost::Reservation::restore(const Caller& caller) {
  if (!before_) return unload(caller);
  ResolvedScene scene = *before_;
  if (target_) scene.spec.target = *target_;
  return host_->load_resolved(std::move(scene), caller, Right::kReserved);
}

SceneHost::Hold SceneHost::hold(Caller::Clock::time_point until) {
  Hold hold;
  const std::unique_lock gate(gate_, until);
  if (gate) hold.lock_ = std::shared_lock(exchange_, until);
  return hold;
}

}  // namespace hapticd::server
