#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "rt/record/tick_record.h"
#include "rt/scene/compose.h"
#include "rt/scene/corrected_pipeline.h"
#include "rt/target/largest_target.h"
#include "server/calibration/model/arm_calibration.h"
#include "server/scene/scene_file.h"
#include "server/scene/scene_host.h"
#include "server/scene/scene_inclusions.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

/// Remark on how reliable a part is: its fit if it has one, its source, and warnings.
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

/// Limits targets by default: on a soft object to less than the device could hold. The stiffness with which
/// the scene itself starts is always allowed.
void limit_to_object(ResolvedScene& scene) {
  const auto own_n_per_mm = rt::stiffness_n_per_mm(scene.model->model, rt::kFirmPressN);
  if (!own_n_per_mm) return;
  const double asked = rt::greatest_stiffness_n_per_mm(scene.spec.target, rt::kMaxTargetDepthMm);
  double& largest = scene.spec.max_target_stiffness_n_per_mm;
  largest = std::max(asked, std::min(largest, rt::kMaxTargetOverObject * *own_n_per_mm));
}

/// Friction of a ball bearing is used if it was identified; no scene needs it.
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

std::string_view in_words(std::string_view tip) {
  return tip == "ball_bearing" ? "ball bearing" : tip;
}

/// The scene's friction and contact are of its tip; a simulated rig knows its own.
void say_other_tip(ResolvedScene& scene, const Session& session) {
  const bool is_simulated = session.rig_info().kind == hal::RigKind::kSimulated;
  if (!is_simulated || session.simulation() == nullptr || scene.spec.kind != rt::SceneKind::kExplore) return;
  const std::string& simulated = session.simulation()->tip();
  if (simulated == word_of(scene.spec.tip)) return;
  scene.remarks.push_back(
      fmt::format("the scene is for a {}, the simulated tool is a {}: set tip in [rig.sim]",
                  in_words(word_of(scene.spec.tip)), in_words(simulated)));
}

}  // namespace

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
  if (auto refusal = fill_inclusions(models_, session_.rig_info(), *spec, of_rig.stored, of_rig.remarks)) {
    return *refusal;
  }
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
  find_calibration(scene);
  if (rolls) say_bearing_friction(scene, session_.rig_info());
  say_other_tip(scene, session_);
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
    bool is_of_ball_bearing = false;
    if (scene.model && available) {
      remark = remark_on(name, *scene.model, scene.spec, session_.rig_info());
    } else if (scene.model) {
      remark = "the model has no such part";
      is_of_ball_bearing = name.starts_with("friction") && models_.has_friction_of_bearing(wanted);
      if (is_of_ball_bearing) {
        remark += ": its friction was identified with the ball bearing";
      }
    }
    scene.needs.push_back({name, available, std::move(remark), is_of_ball_bearing});
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

void SceneHost::find_calibration(ResolvedScene& scene) const {
  if (!scene.spec.corrected_poses) return;
  scene.calibration = calibration_in_use_ ? calibration_in_use_() : nullptr;
  scene.remarks.push_back(scene.calibration
                              ? "poses: corrected by calibration " + scene.calibration->name.substr(0, 12)
                              : "poses: no calibration is adopted; the scene cannot be loaded");
}

Outcome<std::unique_ptr<rt::Pipeline>> SceneHost::compose(const ResolvedScene& scene) const {
  auto stages = compose_stages(scene);
  if (!stages || !scene.spec.corrected_poses) return stages;
  const auto lacking = [&](const char* what, const char* remedy) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {what, "scene '" + scene.spec.name + "'", "corrected_poses = true", "", remedy}};
  };
  if (!scene.calibration) {
    return lacking("the scene works on corrected poses, and no calibration is adopted",
                   "calibrate the device and adopt what was found, or remove the key");
  }
  if (scene.calibration->arm.use == rt::AngleUse::kNone) {
    return lacking("the adopted calibration corrects no pose: it was made without the device's angles",
                   "calibrate the device's kinematics, or remove the key");
  }
  return std::unique_ptr<rt::Pipeline>(
      std::make_unique<rt::CorrectedPipeline>(std::move(*stages), *scene.calibration));
}

Outcome<std::unique_ptr<rt::Pipeline>> SceneHost::compose_stages(const ResolvedScene& scene) const {
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
      if (need.is_of_ball_bearing) {
        error.remedy = need.remark + "; mount that tip and say so in the scene, or identify the rod's";
      }
    }
  }
  return Refusal{RefusalKind::kFailedPrecondition, error};
}

}  // namespace hapticd::server
