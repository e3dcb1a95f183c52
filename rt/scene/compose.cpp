#include "rt/scene/compose.h"

#include "rt/scene/effects.h"
#include "rt/scene/explore_pipeline.h"
#include "rt/scene/tap_pipeline.h"
#include "rt/scene/wall_pipeline.h"

namespace hapticd::rt {

namespace {

hal::Error lacking(const SceneSpec& spec, const hal::RigInfo& rig, const char* part) {
  return {std::string("the scene needs a ") + part + ", the rig has none", "scene '" + spec.name + "'",
          rig.name, "", "load a scene that does without, or start the daemon on another rig"};
}

enum class Part : std::uint8_t { kCreep, kHuntCrossley, kRodFriction };

std::vector<Part> needed_parts(const SceneSpec& spec) {
  std::vector<Part> parts;
  if (spec.kind != SceneKind::kExplore) return parts;
  if (spec.explore.displacement != DisplacementEstimator::kRecursive) {
    parts.push_back(spec.explore.law == ContactLawKind::kCreep ? Part::kCreep : Part::kHuntCrossley);
  }
  if (spec.tip == Tip::kRod) parts.push_back(Part::kRodFriction);
  return parts;
}

const char* name_of(Part part) {
  switch (part) {
    case Part::kCreep:
      return "creep law";
    case Part::kHuntCrossley:
      return "Hunt-Crossley law";
    case Part::kRodFriction:
      return "friction of the rod";
  }
  return "";
}

bool has(const ObjectModel& model, Part part) {
  switch (part) {
    case Part::kCreep:
      return model.creep.has_value();
    case Part::kHuntCrossley:
      return model.hunt_crossley.has_value();
    case Part::kRodFriction:
      return model.rod_friction.has_value();
  }
  return false;
}

/// Names every part that is not there.
std::optional<hal::Error> missing(const SceneSpec& spec, const ObjectModel* model) {
  std::string names;
  for (const std::string& name : needed_models(spec, model)) names += (names.empty() ? "" : ", ") + name;
  if (names.empty()) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kNotFound, "the scene needs a model that there is not: " + names,
                        "scene '" + spec.name + "'", "object_model = \"" + spec.object_model + "\"", "",
                        "identify the object, name another object_model, or choose a ball bearing and "
                        "displacement.estimator = \"recursive\", which need none");
}

}  // namespace

std::vector<std::string> needed_models(const SceneSpec& resolved, const ObjectModel* model) {
  std::vector<std::string> names;
  for (const Part part : needed_parts(resolved)) {
    if (model != nullptr && has(*model, part)) continue;
    names.push_back(std::string(name_of(part)) + " of '" + resolved.object_model + "'");
  }
  return names;
}

hal::Result<std::unique_ptr<Pipeline>> compose(const SceneSpec& resolved, const hal::RigInfo& rig,
                                               const ObjectModel* model) {
  if (rig.device.model.empty()) return lacking(resolved, rig, "haptic device");
  if (resolved.kind != SceneKind::kWall && rig.sensor.model.empty()) {
    return lacking(resolved, rig, "force sensor");
  }
  if (resolved.kind != SceneKind::kExplore && resolved.object_model != "none") {
    return hal::Error::of(hal::ErrorCode::kMisplacedKey, "the scene has no use for a model",
                          "scene '" + resolved.name + "'", "object_model = \"" + resolved.object_model + "\"",
                          "object_model = \"none\"",
                          "one-dimensional scenes work from the measured force alone");
  }
  if (auto error = missing(resolved, model)) return *error;
  for (const Effect& effect : effects()) {
    if (effect.check == nullptr || !effect.is_asked_for(resolved)) continue;
    if (auto error = effect.check(resolved, model, rig)) return *error;
  }
  if (resolved.fixture) {
    if (auto error = check(*resolved.fixture, "scene '" + resolved.name + "'")) return *error;
  }
  if (resolved.watch) {
    if (auto error = check(*resolved.watch, "scene '" + resolved.name + "'")) return *error;
  }
  if (model != nullptr) {
    if (auto error = check(*model)) return *error;
  }
  switch (resolved.kind) {
    case SceneKind::kTap1d:
      return std::unique_ptr<Pipeline>(std::make_unique<TapPipeline>(resolved, rig));
    case SceneKind::kWall:
      return std::unique_ptr<Pipeline>(std::make_unique<WallPipeline>(resolved, rig));
    case SceneKind::kExplore: {
      const ObjectModel known = model != nullptr ? *model : ObjectModel{};
      return std::unique_ptr<Pipeline>(
          std::make_unique<ExplorePipeline>(resolved, known, rig, contributions_of(resolved, known, rig)));
    }
  }
  return hal::Error{"unknown kind of scene", "scene '" + resolved.name + "'", "", "", ""};
}

}  // namespace hapticd::rt
