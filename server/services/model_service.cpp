#include "server/services/model_service.h"

#include "server/model_file.h"
#include "server/model_library.h"
#include "server/services/status.h"
#include "server/text_library.h"

namespace hapticd::server {

namespace {

void fill(const rt::ObjectModel& model, v1::ModelSummary& summary) {
  summary.set_name(model.name);
  summary.set_identified_on(model.identified_on);
  summary.set_hunt_crossley(model.hunt_crossley.has_value());
  summary.set_creep(model.creep.has_value());
  summary.set_rod_friction(model.rod_friction.has_value());
  summary.set_max_displacement_mm(model.max_displacement_mm);
  summary.set_max_force_n(model.max_force_n);
  if (model.hunt_crossley) summary.set_hunt_crossley_relative_error(model.hunt_crossley->relative_error);
  if (model.creep) summary.set_creep_relative_error(model.creep->relative_error);
}

}  // namespace

grpc::Status ModelService::ListModels(grpc::ServerContext*, const v1::ListModelsRequest*,
                                      v1::ListModelsResponse* response) {
  for (const ModelLibrary::Entry& entry : models_.list()) {
    v1::ModelSummary& summary = *response->add_models();
    if (entry.model) {
      fill(*entry.model, summary);
    } else {
      summary.set_name(entry.name);
      summary.set_problem(entry.problem);
    }
  }
  return grpc::Status::OK;
}

grpc::Status ModelService::GetModel(grpc::ServerContext*, const v1::GetModelRequest* request,
                                    v1::GetModelResponse* response) {
  if (const auto error = check_name("model", request->name(), "GetModelRequest.name")) {
    return to_status({RefusalKind::kInvalidArgument, *error});
  }
  const auto model = models_.find(request->name());
  if (!model) {
    const bool known = models_.contains(request->name());
    return to_status({known ? RefusalKind::kInvalidArgument : RefusalKind::kNotFound, model.error()});
  }
  fill(*model, *response->mutable_summary());
  response->set_toml(write_model(*model));
  return grpc::Status::OK;
}

}  // namespace hapticd::server
