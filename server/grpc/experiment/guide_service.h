#pragma once

#include "hapticd/v1/guide.grpc.pb.h"

namespace hapticd::server {

class GuideHost;

class GuideService final : public v1::GuideService::Service {
 public:
  explicit GuideService(GuideHost& host) : host_(host) {}

  grpc::Status MoveTool(grpc::ServerContext* context, const v1::MoveToolRequest* request,
                        grpc::ServerWriter<v1::GuideStatus>* writer) override;

 private:
  GuideHost& host_;
};

}  // namespace hapticd::server
