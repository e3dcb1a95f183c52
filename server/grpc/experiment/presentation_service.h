#pragma once

#include "hapticd/v1/presentation.grpc.pb.h"

namespace hapticd::server {

class Session;

class PresentationService final : public v1::PresentationService::Service {
 public:
  explicit PresentationService(Session& session) : session_(session) {}

  grpc::Status BeginPresentation(grpc::ServerContext* context, const v1::BeginPresentationRequest* request,
                                 v1::BeginPresentationResponse* response) override;
  grpc::Status EndPresentation(grpc::ServerContext* context, const v1::EndPresentationRequest* request,
                               v1::PresentationSummary* response) override;

 private:
  Session& session_;
};

}  // namespace hapticd::server
