#pragma once

#include "hapticd/v1/simulation.grpc.pb.h"

namespace hapticd::server {

class SceneHost;
class Session;

/// Hand and object of a simulated rig; refuses on any other.
class SimulationService final : public v1::SimulationService::Service {
 public:
  SimulationService(Session& session, const SceneHost& scenes) : session_(session), scenes_(scenes) {}

  grpc::Status GetSimulation(grpc::ServerContext* context, const v1::GetSimulationRequest* request,
                             v1::SimulationInfo* response) override;
  grpc::Status SetHandProgram(grpc::ServerContext* context, const v1::SetHandProgramRequest* request,
                              v1::SetHandProgramResponse* response) override;
  grpc::Status SetObject(grpc::ServerContext* context, const v1::SetObjectRequest* request,
                         v1::SetObjectResponse* response) override;

 private:
  Session& session_;
  const SceneHost& scenes_;
};

}  // namespace hapticd::server
