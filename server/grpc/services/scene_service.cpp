#include "server/grpc/services/scene_service.h"

#include <optional>
#include <string>

#include "rt/record/tick_record.h"
#include "rt/target/largest_target.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/messages/status.h"
#include "server/scene/scene_cost.h"
#include "server/scene/scene_file.h"
#include "server/scene/scene_host.h"
#include "server/scene/target_control.h"

namespace hapticd::server {

namespace {

/// Short, except for loads that wait until the tool is out of contact.
constexpr int kMaxLoads = 8;

struct ChannelName {
  std::uint32_t channel;
  const char* name;
};
constexpr ChannelName kChannelNames[] = {
    {rt::channel::kSample, "sample"},     {rt::channel::kMotion, "motion"},
    {rt::channel::kContact, "contact"},   {rt::channel::kDeformation, "deformation"},
    {rt::channel::kTarget, "target"},     {rt::channel::kControl, "control"},
    {rt::channel::kGuard, "guard"},       {rt::channel::kTiming, "timing"},
    {rt::channel::kTruth, "truth"},       {rt::channel::kDirection, "direction"},
    {rt::channel::kFusion, "fusion"},     {rt::channel::kPassivity, "passivity"},
    {rt::channel::kZero, "zero"},         {rt::channel::kInclusion, "inclusion"},
    {rt::channel::kFriction, "friction"}, {rt::channel::kTransient, "transient"},
    {rt::channel::kAngles, "angles"},     {rt::channel::kAssist, "assist"}};

void fill_outline(const ResolvedScene& scene, v1::SceneOutline& outline) {
  outline.set_name(scene.spec.name);
  outline.set_description(scene.spec.description);
  outline.set_tip(std::string(word_of(scene.spec.tip)));
  outline.set_object_model(scene.spec.object_model);
  for (const std::string& stage : scene.outline.stages) outline.add_stages(stage);
  for (const std::string& hardware : scene.outline.hardware) outline.add_hardware(hardware);
  for (const std::string& model : scene.outline.models) outline.add_models(model);
  for (const ModelNeed& need : scene.needs) {
    v1::ModelNeed& reported = *outline.add_model_needs();
    reported.set_name(need.name);
    reported.set_available(need.available);
    reported.set_remark(need.remark);
  }
  for (const std::string& remark : scene.remarks) outline.add_remarks(remark);
  for (const ChannelName& channel : kChannelNames) {
    if ((scene.outline.channels & channel.channel) != 0) outline.add_telemetry_groups(channel.name);
  }
  outline.set_target_law(std::string(word_of(scene.spec.target.kind)));
  outline.set_target_stiffness_n_per_mm(
      rt::greatest_stiffness_n_per_mm(scene.spec.target, rt::kMaxTargetDepthMm));
  outline.set_max_target_stiffness_n_per_mm(scene.spec.max_target_stiffness_n_per_mm);
  outline.set_resolved_toml(write_scene(scene.spec));
}

/// The source a request names; nothing when it names none.
template <class Request>
std::optional<SceneSource> source_of(const Request& request) {
  switch (request.source_case()) {
    case Request::kName:
      return SceneSource{SceneSource::Kind::kName, request.name(), request.object_model()};
    case Request::kToml:
      return SceneSource{SceneSource::Kind::kToml, request.toml(), request.object_model()};
    case Request::SOURCE_NOT_SET:
      break;
  }
  return std::nullopt;
}

grpc::Status no_source(const char* request) {
  return to_status(
      {RefusalKind::kInvalidArgument,
       {"no scene is named", std::string(request) + ".source", "", "name or toml", "give one of them"}});
}

}  // namespace

grpc::Status SceneService::ListScenes(grpc::ServerContext*, const v1::ListScenesRequest*,
                                      v1::ListScenesResponse* response) {
  const auto current = scenes_.current();
  bool listed = false;
  for (const SceneLibrary::Entry& entry : scenes_.catalogue().list()) {
    v1::SceneSummary& scene = *response->add_scenes();
    scene.set_name(entry.name);
    scene.set_description(entry.description);
    scene.set_loaded(current && current->spec.name == entry.name);
    listed = listed || scene.loaded();
  }
  if (current && !listed) {  // loaded as text
    v1::SceneSummary& scene = *response->add_scenes();
    scene.set_name(current->spec.name);
    scene.set_description(current->spec.description);
    scene.set_loaded(true);
  }
  return grpc::Status::OK;
}

grpc::Status SceneService::LoadScene(grpc::ServerContext* context, const v1::LoadSceneRequest* request,
                                     v1::LoadSceneResponse* response) {
  const CountedCall counted(loads_, kMaxLoads);
  if (!counted.admitted()) return counted.refusal("scenes that are loaded", "SceneService.LoadScene");
  const auto source = source_of(*request);
  if (!source) return no_source("LoadSceneRequest");
  const auto loaded = scenes_.load(*source, caller_of(*context));
  if (!loaded) return to_status(loaded.refusal());
  log_call("scene '" + loaded->scene->spec.name + "' was loaded", *context);
  fill_outline(*loaded->scene, *response->mutable_outline());
  response->set_effective_tick(loaded->effective_tick);
  return grpc::Status::OK;
}

grpc::Status SceneService::UnloadScene(grpc::ServerContext* context, const v1::UnloadSceneRequest*,
                                       v1::UnloadSceneResponse* response) {
  const auto unloaded = scenes_.unload(caller_of(*context));
  if (!unloaded) return to_status(unloaded.refusal());
  log_call("the scene was unloaded", *context);
  response->set_effective_tick(unloaded->effective_tick);
  return grpc::Status::OK;
}

grpc::Status SceneService::ExplainScene(grpc::ServerContext*, const v1::ExplainSceneRequest* request,
                                        v1::SceneOutline* response) {
  const CountedCall counted(explanations_, kMaxSlowCalls);
  if (!counted.admitted()) return counted.refusal("explanations of scenes", "SceneService.ExplainScene");
  const auto source = source_of(*request);
  if (!source) return no_source("ExplainSceneRequest");
  const auto scene = scenes_.resolve(*source);
  if (!scene) return to_status(scene.refusal());
  fill_outline(*scene, *response);
  const auto pipeline = scenes_.compose(*scene);
  if (!pipeline) {
    *response->mutable_obstacle() = to_detail(pipeline.refusal().error);
    return grpc::Status::OK;
  }
  const MutexLock lock(measuring_);
  const SceneCost measured = measure_cost(**pipeline, scene->spec, scenes_.rig_info());
  v1::SceneCost& cost = *response->mutable_cost();
  cost.set_median_ns(measured.median_ns);
  cost.set_p999_ns(measured.p999_ns);
  cost.set_ticks(measured.ticks);
  cost.set_remark(measured.remark);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
