#pragma once

#include "hapticd/v1/rig.grpc.pb.h"

namespace hapticd::server {

class Session;
class SceneHost;
class TelemetryHub;

/// What the rig is and how it fares, from copies: costs the loop nothing.
class RigService final : public v1::RigService::Service {
 public:
  RigService(const Session& session, const SceneHost& scenes, TelemetryHub& hub)
      : session_(session), scenes_(scenes), hub_(hub) {}

  grpc::Status GetRigInfo(grpc::ServerContext* context, const v1::GetRigInfoRequest* request,
                          v1::RigInfo* response) override;
  grpc::Status GetRigState(grpc::ServerContext* context, const v1::GetRigStateRequest* request,
                           v1::RigState* response) override;

 private:
  const Session& session_;
  const SceneHost& scenes_;
  TelemetryHub& hub_;
};

}  // namespace hapticd::server
