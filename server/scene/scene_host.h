#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "rt/model/models.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "server/config/guard_ceilings.h"
#include "server/model/store/model_library.h"
#include "server/scene/scene_library.h"
#include "server/scene/scene_models.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/session.h"

namespace hapticd::calibration {
struct ArmCalibration;
}

namespace hapticd::server {

/// A scene: a name that the library knows, or the text of a scene file.
struct SceneSource {
  enum class Kind : std::uint8_t { kName, kToml };
  Kind kind = Kind::kName;
  std::string text;
  std::string object_model;  ///< instead of the scene's own; empty = the scene's own
};

/// A part of the object's model that a scene uses.
struct ModelNeed {
  std::string name;  ///< as in SceneOutline::models
  bool available = false;
  std::string remark;  ///< how well it fits and where it was identified; or why there is none
  /// The object's friction is known for the ball bearing only, and the scene has another tip.
  bool is_of_ball_bearing = false;
};

/// A scene resolved for the rig, with the model of its object.
struct ResolvedScene {
  rt::SceneSpec spec;
  rt::SceneOutline outline;  ///< with the channels that every tick has on this rig
  std::vector<ModelNeed> needs;
  std::optional<FoundModel> model;          ///< of spec.object_model, if the scene needs one
  std::optional<hal::Error> model_problem;  ///< why there is none
  std::vector<std::string> stored;          ///< hashes of the stored models that it uses, sorted
  std::vector<std::string> remarks;         ///< which values come from the rig's own models
  /// Calibration of the arm, if the scene works on corrected poses; null if none is adopted.
  std::shared_ptr<const calibration::ArmCalibration> calibration;
  /// The scene as it was written, without the object's model: two scenes with the same text differ in models
  /// only.
  std::string written;

  const rt::ObjectModel* object_model() const { return model ? &model->model : nullptr; }
};

/// Holds the loaded scene: resolves, composes, exchanges pipelines at a tick boundary, and
/// deletes the retired ones outside the loop. Any thread.
class SceneHost {
 public:
  SceneHost(Session& session, SceneLibrary scenes, ModelLibrary models, const GuardCeilings& ceilings = {});

  /// Loads a scene before the loop runs, so that no tick of a recording is missed.
  std::optional<hal::Error> preload(const std::string& name);
  /// Called before a scene is loaded that names a station of the turntable. Set it before the first load.
  using StationCheck = Callback<std::optional<Refusal>(const std::string& station)>;
  void check_stations_with(StationCheck check) { check_station_ = std::move(check); }
  /// Called when a scene is resolved, for the present zero of the force sensor. Set it before the first load.
  using ZeroSource = Callback<ZeroInForce()>;
  void know_zero_by(ZeroSource source) { zero_in_force_ = std::move(source); }
  /// Called when a scene is resolved that works on corrected poses; null: no calibration is adopted. Set it
  /// before the first load.
  using CalibrationSource = Callback<std::shared_ptr<const calibration::ArmCalibration>()>;
  void know_calibration_by(CalibrationSource source) { calibration_in_use_ = std::move(source); }
  /// Opens the hardware that the loaded scene needs, before the loop runs. load() does it by itself.
  std::optional<hal::Error> open_hardware();

  struct Loaded {
    std::shared_ptr<const ResolvedScene> scene;  ///< null after an unload
    std::uint64_t effective_tick = 0;
  };
  /// Loads a scene. One that differs from the loaded one in models only replaces it out of contact: the call
  /// waits for that, to the caller's deadline at the latest. Any other scene replaces it at once.
  Outcome<Loaded> load(const SceneSource& source, const Caller& caller);
  Outcome<Loaded> unload(const Caller& caller);
  /// Resolves the scene for this rig, even if some of its parts are missing.
  Outcome<ResolvedScene> resolve(const SceneSource& source) const;
  /// Composes a scene's stages, owned by the caller. Refused if the rig or the object's model lacks a part;
  /// the error names it.
  Outcome<std::unique_ptr<rt::Pipeline>> compose(const ResolvedScene& scene) const;

  /// Null when none is loaded.
  std::shared_ptr<const ResolvedScene> current() const;
  /// True if the loaded scene uses this stored model.
  bool uses(const std::string& hash) const;
  const SceneLibrary& catalogue() const { return library_; }
  const ModelLibrary& models() const { return models_; }
  const hal::RigInfo& rig_info() const { return session_.rig_info(); }

  /// Keeps the scene, while held, from being exchanged: a command that was validated for it is still valid
  /// when it takes effect.
  class Hold {
   public:
    bool held() const { return held_ != nullptr; }

   private:
    friend class SceneHost;
    struct Release {
      void operator()(SharedSerialMutex* held) const NO_THREAD_SAFETY_ANALYSIS { held->unlock_shared(); }
    };
    std::unique_ptr<SharedSerialMutex, Release> held_;
  };
  Hold hold(Caller::Clock::time_point until) NO_THREAD_SAFETY_ANALYSIS;

  /// Notes the target that took effect at a tick since the scene was loaded. Call it while the scene is held.
  void note_target(const rt::TargetLaw& law, std::uint64_t tick);
  /// The loaded scene, null if there is none, and the target that was set last, or its own if none was set
  /// since.
  struct InForce {
    std::shared_ptr<const ResolvedScene> scene;
    rt::TargetLaw target;
  };
  InForce in_force() const;

  /// Exclusive control of the scene: while it lives, load(), unload() and targets of other callers are
  /// refused. Starts with the scene that was loaded; restore() loads it again.
  class Reservation {
   public:
    Reservation(Reservation&& other) noexcept
        : host_(std::exchange(other.host_, nullptr)),
          before_(std::move(other.before_)),
          target_(other.target_) {}
    Reservation& operator=(Reservation&&) = delete;
    ~Reservation();
    Outcome<Loaded> load(const rt::SceneSpec& spec, const Caller& caller);
    Outcome<Loaded> unload(const Caller& caller);
    /// Loads the previous scene again, with the target it had. It starts without any present contact.
    Outcome<Loaded> restore(const Caller& caller);

   private:
    friend class SceneHost;
    explicit Reservation(SceneHost& host);
    SceneHost* host_;
    std::shared_ptr<const ResolvedScene> before_;
    std::optional<rt::TargetLaw> target_;
  };
  /// `by`: named in refusals meanwhile, e.g. "identification 'contact-3'".
  Outcome<Reservation> reserve(const std::string& by);
  /// Reason why the scene and its target cannot be changed now; nothing when they can.
  std::optional<Refusal> reserved() const;

 private:
  /// Resolves the spec against the rig and holds it to the ceilings; those that took the place of the scene's
  /// defaults are given in `remarks`.
  Outcome<rt::SceneSpec> resolve_within_ceilings(rt::SceneSpec spec, std::vector<std::string>& remarks) const;
  rt::GuardLimits idle_limits() const;
  void find_model(ResolvedScene& scene) const;
  void find_calibration(ResolvedScene& scene) const;
  /// Composes the stages without what corrects their poses.
  Outcome<std::unique_ptr<rt::Pipeline>> compose_stages(const ResolvedScene& scene) const;
  bool differs_in_models_only(const ResolvedScene* next) const;
  /// Checks the stored models: an error if one that the scene was resolved with was deleted.
  std::optional<Refusal> check_stored(const ResolvedScene& scene) const;
  /// Opens the hardware that a scene (null: none) needs, for as long as it is loaded.
  Outcome<SensorClaim> claim_hardware(const ResolvedScene* scene) const;
  std::optional<Refusal> await_exchangeable(Caller::Clock::time_point until, const Caller& caller) const;
  enum class Right : std::uint8_t { kAnyones, kReserved };
  Outcome<Loaded> load_resolved(ResolvedScene scene, const Caller& caller, Right right);
  Outcome<Loaded> exchange(std::unique_ptr<rt::Pipeline> next, const rt::GuardLimits& guard,
                           std::shared_ptr<const ResolvedScene> scene, const Caller& caller, Right right);

  Session& session_;
  const GuardCeilings ceilings_;  ///< limits of every scene
  StationCheck check_station_;
  ZeroSource zero_in_force_;
  CalibrationSource calibration_in_use_;
  SceneLibrary library_;
  ModelLibrary models_;

  /// Lets an exchange pass a steady stream of holders.
  SerialMutex gate_ ACQUIRED_BEFORE(exchange_);
  /// Commands that are under way share it; an exchange has it alone.
  SharedSerialMutex exchange_ ACQUIRED_BEFORE(current_mutex_);
  std::unique_ptr<rt::Pipeline> live_ GUARDED_BY(exchange_);  ///< the pipeline in the loop; owned here
  SensorClaim sensor_ GUARDED_BY(exchange_);                  ///< of the loaded scene

  mutable Mutex current_mutex_;
  std::shared_ptr<const ResolvedScene> current_ GUARDED_BY(current_mutex_);
  std::optional<rt::TargetLaw> target_ GUARDED_BY(current_mutex_);  ///< see note_target()
  std::uint64_t target_tick_ GUARDED_BY(current_mutex_) = 0;        ///< of target_
  std::string reserved_by_ GUARDED_BY(current_mutex_);              ///< empty: not reserved
};

}  // namespace hapticd::server
