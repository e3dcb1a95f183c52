#pragma once

#include "hapticd/v1/model.grpc.pb.h"

namespace hapticd::server {

class ModelLibrary;
class ModelStore;
class SceneHost;

/// The models that scenes can ask for, and the store of identified ones.
class ModelService final : public v1::ModelService::Service {
 public:
  explicit ModelService(const SceneHost& scenes) : scenes_(scenes) {}

  grpc::Status ListModels(grpc::ServerContext* context, const v1::ListModelsRequest* request,
                          v1::ListModelsResponse* response) override;
  grpc::Status GetModel(grpc::ServerContext* context, const v1::GetModelRequest* request,
                        v1::GetModelResponse* response) override;

  grpc::Status ListStoredModels(grpc::ServerContext* context, const v1::ListStoredModelsRequest* request,
                                v1::ListStoredModelsResponse* response) override;
  grpc::Status GetStoredModel(grpc::ServerContext* context, const v1::GetStoredModelRequest* request,
                              v1::StoredModel* response) override;
  grpc::Status DiffStoredModels(grpc::ServerContext* context, const v1::DiffStoredModelsRequest* request,
                                v1::DiffStoredModelsResponse* response) override;
  grpc::Status TagStoredModel(grpc::ServerContext* context, const v1::TagStoredModelRequest* request,
                              v1::StoredModel* response) override;
  grpc::Status UntagStoredModel(grpc::ServerContext* context, const v1::UntagStoredModelRequest* request,
                                v1::StoredModel* response) override;
  grpc::Status DeleteStoredModel(grpc::ServerContext* context, const v1::DeleteStoredModelRequest* request,
                                 v1::DeleteStoredModelResponse* response) override;
  grpc::Status ExportStoredModel(grpc::ServerContext* context, const v1::ExportStoredModelRequest* request,
                                 v1::ExportStoredModelResponse* response) override;
  grpc::Status ImportStoredModel(grpc::ServerContext* context, const v1::ImportStoredModelRequest* request,
                                 v1::StoredModel* response) override;

 private:
  const ModelLibrary& models() const;
  ModelStore& store() const;

  const SceneHost& scenes_;
};

}  // namespace hapticd::server
