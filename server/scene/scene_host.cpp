#include "server/scene/scene_host.h"

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

Refusal busy_with(const std::string& by) {
  return {RefusalKind::kFailedPrecondition,
          {by + " is under way", "scene", "", "", "wait until it is over, or cancel it"},
          Reason::kBusy};
}

/// A waiting exchange ends this long before the caller's deadline, so that the reason still arrives.
constexpr std::chrono::milliseconds kReplyTime{200};
constexpr std::chrono::seconds kMaxExchangeWait{60};
/// An exchange is handed to the loop for this time; targets may pass in between.
constexpr std::chrono::milliseconds kSlice{100};
constexpr std::chrono::milliseconds kPollInterval{2};

}  // namespace

SceneHost::SceneHost(Session& session, SceneLibrary scenes, ModelLibrary models,
                     const GuardCeilings& ceilings)
    : session_(session), ceilings_(ceilings), library_(std::move(scenes)), models_(std::move(models)) {}

std::optional<hal::Error> SceneHost::preload(const std::string& name) {
  auto scene = resolve({SceneSource::Kind::kName, name, {}});
  if (!scene) return scene.refusal().error;
  auto pipeline = compose(*scene);
  if (!pipeline) return pipeline.refusal().error;
  session_.engine().preload(pipeline->get(), scene->spec.guard, rt::assistance_of(scene->spec));
  const MutexLock exclusive(exchange_);
  live_ = std::move(*pipeline);
  const MutexLock lock(current_mutex_);
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
  return before->stored != next->stored || before->calibration != next->calibration ||
         !next->outline.models.empty();
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

std::optional<Refusal> SceneHost::await_exchangeable(Caller::Clock::time_point until,
                                                     const Caller& caller) const {
  while (!session_.engine().can_exchange_scene()) {
    if (auto refusal = session_.unavailable()) return refusal;
    if (auto refusal = caller.lost()) return refusal;
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
  const auto exchangeable_until = caller.until(kMaxExchangeWait) - kReplyTime;
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kExchangeScene;
  command.pipeline = next.get();
  command.guard = guard;
  if (scene) command.assistance = rt::assistance_of(scene->spec);
  for (;;) {
    if (auto refusal = session_.unavailable()) return *refusal;
    // Contact may last long: the gate is not held while waiting, so that targets pass.
    if (differs_in_models_only(scene.get())) {
      if (auto refusal = await_exchangeable(exchangeable_until, caller)) return *refusal;
    }
    const auto timeout = std::max(until, Caller::Clock::now() + kSlice);
    if (!gate_.try_lock_until(timeout)) return busy();
    const MutexLock gate(gate_, std::adopt_lock);
    if (!exchange_.try_lock_until(timeout)) return busy();
    const MutexLock exclusive(exchange_, std::adopt_lock);
    if (right == Right::kAnyones) {
      if (auto refusal = reserved()) return *refusal;
    }
    if (scene) {
      if (auto refusal = check_stored(*scene)) return *refusal;
    }
    command.when_exchangeable = differs_in_models_only(scene.get());
    const auto outcome =
        session_.execute(command, caller, command.when_exchangeable ? kSlice : kDefaultTimeout);
    if (!outcome) {
      const bool touched_again =
          command.when_exchangeable && outcome.refusal().kind == RefusalKind::kDeadlineExceeded;
      if (!touched_again) return outcome.refusal();
      if (Caller::Clock::now() >= exchangeable_until) return in_contact();
      continue;
    }

    live_ = std::move(next);  // deletes the retired one, here and not in the loop
    {
      const MutexLock lock(current_mutex_);
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
  const MutexLock exclusive(exchange_);
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
  const MutexLock lock(current_mutex_);
  return current_;
}

std::optional<Refusal> SceneHost::reserved() const {
  const MutexLock lock(current_mutex_);
  return reserved_by_.empty() ? std::nullopt : std::optional(busy_with(reserved_by_));
}

Outcome<SceneHost::Reservation> SceneHost::reserve(const std::string& by) {
  {
    const MutexLock lock(current_mutex_);
    if (!reserved_by_.empty()) return busy_with(reserved_by_);
    reserved_by_ = by;
  }
  return Reservation(*this);
}

void SceneHost::note_target(const rt::TargetLaw& law, std::uint64_t tick) {
  const MutexLock lock(current_mutex_);
  if (target_ && tick < target_tick_) return;  // two callers at once: the later tick counts
  target_ = law;
  target_tick_ = tick;
}

SceneHost::InForce SceneHost::in_force() const {
  const MutexLock lock(current_mutex_);
  if (target_) return {current_, *target_};
  return {current_, current_ ? current_->spec.target : rt::TargetLaw{}};
}

SceneHost::Reservation::Reservation(SceneHost& host) : host_(&host) {
  const MutexLock lock(host.current_mutex_);
  before_ = host.current_;
  target_ = host.target_;
}

SceneHost::Reservation::~Reservation() {
  if (host_ == nullptr) return;
  const MutexLock lock(host_->current_mutex_);
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

// What holds it lets it go: no function does.
SceneHost::Hold SceneHost::hold(Caller::Clock::time_point until) {
  Hold hold;
  if (!gate_.try_lock_until(until)) return hold;
  if (exchange_.try_lock_shared_until(until)) hold.held_.reset(&exchange_);
  gate_.unlock();
  return hold;
}

}  // namespace hapticd::server
