#include "server/grpc/services/model_service.h"

#include "server/grpc/calls/call.h"
#include "server/grpc/messages/status.h"
#include "server/model/model_file.h"
#include "server/model/store/model_diff.h"
#include "server/model/store/model_library.h"
#include "server/model/store/model_store.h"
#include "server/scene/scene_host.h"

namespace hapticd::server {

namespace {

void fill(const rt::ObjectModel& model, const std::vector<std::string>& stored, v1::ModelSummary& summary) {
  summary.set_name(model.name);
  summary.set_identified_on(model.identified_on);
  summary.set_hunt_crossley(model.hunt_crossley.has_value());
  summary.set_creep(model.creep.has_value());
  summary.set_rod_friction(model.rod_friction.has_value());
  summary.set_max_displacement_mm(model.max_displacement_mm);
  summary.set_max_force_n(model.max_force_n);
  if (model.hunt_crossley) summary.set_hunt_crossley_relative_error(model.hunt_crossley->relative_error);
  if (model.creep) summary.set_creep_relative_error(model.creep->relative_error);
  for (const std::string& hash : stored) summary.add_stored(hash);
}

void fill(const StoredModel& stored, const SceneHost& scenes, v1::StoredModel& reported) {
  const rt::IdentifiedModel& model = stored.model;
  reported.set_hash(stored.hash);
  reported.set_kind(rt::kind_name(model.content));
  reported.set_object(model.object);
  reported.set_device(model.device);
  reported.set_sensor(model.sensor);
  reported.set_procedure(model.procedure);
  reported.set_data_reference(model.data_reference);
  for (const rt::EstimatedParameter& estimated : model.parameters) {
    v1::EstimatedParameter& parameter = *reported.add_parameters();
    parameter.set_name(estimated.name);
    parameter.set_unit(estimated.unit);
    parameter.set_value(estimated.value);
    parameter.set_standard_error(estimated.standard_error);
  }
  reported.set_max_displacement_mm(model.validity.max_displacement_mm);
  reported.set_max_speed_mm_per_s(model.validity.max_speed_mm_per_s);
  reported.set_max_force_n(model.validity.max_force_n);
  reported.set_residual(model.residual);
  reported.set_converged(model.converged);
  reported.set_stored_at_unix_s(stored.stored_at_unix_s);
  for (const std::string& tag : stored.tags) reported.add_tags(tag);
  reported.set_rig_kind(stored.rig_kind);
  reported.set_in_use(scenes.uses(stored.hash));
}

grpc::Status answer(const Outcome<StoredModel>& stored, const SceneHost& scenes, v1::StoredModel& reported) {
  if (!stored) return to_status(stored.refusal());
  fill(*stored, scenes, reported);
  return grpc::Status::OK;
}

/// End of the wait for another process that keeps the store locked.
ModelStore::Until until(const grpc::ServerContext& context) {
  return caller_of(context).until(kDefaultTimeout);
}

}  // namespace

const ModelLibrary& ModelService::models() const {
  return scenes_.models();
}

ModelStore& ModelService::store() const {
  return *scenes_.models().store();
}

grpc::Status ModelService::ListModels(grpc::ServerContext*, const v1::ListModelsRequest*,
                                      v1::ListModelsResponse* response) {
  for (const ModelLibrary::Entry& entry : models().list()) {
    v1::ModelSummary& summary = *response->add_models();
    if (entry.model) {
      fill(*entry.model, entry.stored, summary);
    } else {
      summary.set_name(entry.name);
      summary.set_problem(entry.problem);
    }
  }
  return grpc::Status::OK;
}

grpc::Status ModelService::GetModel(grpc::ServerContext*, const v1::GetModelRequest* request,
                                    v1::GetModelResponse* response) {
  if (const auto name = ModelName::parse(request->name(), "GetModelRequest.name"); !name) {
    return to_status({RefusalKind::kInvalidArgument, name.error()});
  }
  const auto found = models().find_parts(request->name());
  if (!found) return to_status(found.refusal());
  fill(found->model, found->stored(), *response->mutable_summary());
  response->set_toml(write_model(found->model));
  return grpc::Status::OK;
}

grpc::Status ModelService::ListStoredModels(grpc::ServerContext* context,
                                            const v1::ListStoredModelsRequest* request,
                                            v1::ListStoredModelsResponse* response) {
  const auto stored = store().list({request->kind(), request->object(), request->tag()}, until(*context));
  if (!stored) return to_status(stored.refusal());
  for (const StoredModel& model : *stored) fill(model, scenes_, *response->add_models());
  return grpc::Status::OK;
}

grpc::Status ModelService::GetStoredModel(grpc::ServerContext* context,
                                          const v1::GetStoredModelRequest* request,
                                          v1::StoredModel* response) {
  return answer(store().get(request->hash(), until(*context)), scenes_, *response);
}

grpc::Status ModelService::DiffStoredModels(grpc::ServerContext* context,
                                            const v1::DiffStoredModelsRequest* request,
                                            v1::DiffStoredModelsResponse* response) {
  const auto a = store().get(request->hash_a(), until(*context));
  if (!a) return to_status(a.refusal());
  const auto b = store().get(request->hash_b(), until(*context));
  if (!b) return to_status(b.refusal());
  const auto differences = difference(*a, *b);
  if (!differences) return to_status(differences.refusal());
  fill(*a, scenes_, *response->mutable_a());
  fill(*b, scenes_, *response->mutable_b());
  for (const ParameterDifference& apart : differences->parameters) {
    v1::ParameterDifference& reported = *response->add_parameters();
    reported.set_name(apart.name);
    reported.set_unit(apart.unit);
    if (apart.value_a) reported.set_value_a(*apart.value_a);
    if (apart.value_b) reported.set_value_b(*apart.value_b);
    if (apart.relative) reported.set_relative(*apart.relative);
    if (apart.deviations) reported.set_deviations(*apart.deviations);
  }
  for (const std::string& remark : differences->remarks) response->add_remarks(remark);
  return grpc::Status::OK;
}

grpc::Status ModelService::TagStoredModel(grpc::ServerContext* context,
                                          const v1::TagStoredModelRequest* request,
                                          v1::StoredModel* response) {
  const auto tagged = store().tag(request->hash(), request->tag(), until(*context));
  if (tagged) log_call("model " + tagged->short_hash() + " tagged '" + request->tag() + "'", *context);
  return answer(tagged, scenes_, *response);
}

grpc::Status ModelService::UntagStoredModel(grpc::ServerContext* context,
                                            const v1::UntagStoredModelRequest* request,
                                            v1::StoredModel* response) {
  return answer(store().untag(request->hash(), request->tag(), until(*context)), scenes_, *response);
}

grpc::Status ModelService::DeleteStoredModel(grpc::ServerContext* context,
                                             const v1::DeleteStoredModelRequest* request,
                                             v1::DeleteStoredModelResponse* response) {
  const auto hash = store().erase(
      request->hash(), [this](const std::string& whole) { return scenes_.uses(whole); }, until(*context));
  if (!hash) return to_status(hash.refusal());
  log_call("model " + hash->substr(0, StoredModel::kShortHash) + " deleted", *context);
  response->set_hash(*hash);
  return grpc::Status::OK;
}

grpc::Status ModelService::ExportStoredModel(grpc::ServerContext* context,
                                             const v1::ExportStoredModelRequest* request,
                                             v1::ExportStoredModelResponse* response) {
  auto json = store().export_json(request->hash(), until(*context));
  if (!json) return to_status(json.refusal());
  response->set_json(std::move(*json));
  return grpc::Status::OK;
}

grpc::Status ModelService::ImportStoredModel(grpc::ServerContext* context,
                                             const v1::ImportStoredModelRequest* request,
                                             v1::StoredModel* response) {
  const auto imported = store().import_json(request->json(), until(*context));
  if (imported) log_call("model " + imported->short_hash() + " imported", *context);
  return answer(imported, scenes_, *response);
}

}  // namespace hapticd::server
