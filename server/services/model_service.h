#pragma once

#include "hapticd/v1/model.grpc.pb.h"

namespace hapticd::server {

class ModelLibrary;

/// The models of objects that the daemon knows.
class ModelService final : public v1::ModelService::Service {
 public:
  explicit ModelService(const ModelLibrary& models) : models_(models) {}

  grpc::Status ListModels(grpc::ServerContext* context, const v1::ListModelsRequest* request,
                          v1::ListModelsResponse* response) override;
  grpc::Status GetModel(grpc::ServerContext* context, const v1::GetModelRequest* request,
                        v1::GetModelResponse* response) override;

 private:
  const ModelLibrary& models_;
};

}  // namespace hapticd::server
