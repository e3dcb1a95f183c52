#pragma once

#include <atomic>
#include <string>
#include <utility>

#include "hapticd/v1/rig.grpc.pb.h"

namespace hapticd::server {

class FlightRecorder;
class Recorder;
class Session;
class SceneHost;
class SensorBiases;
class TelemetryHub;
class TurntableHost;
class Watchdog;

/// Properties and state of the rig, from copies; bias and homing of hardware.
class RigService final : public v1::RigService::Service {
 public:
  RigService(Session& session, const SceneHost& scenes, TelemetryHub& hub, SensorBiases& biases,
             TurntableHost& turntable, const Watchdog& watchdog, Recorder& recorder,
             const FlightRecorder& flight, std::string certificates = {}, std::string state_folder = {})
      : session_(session),
        scenes_(scenes),
        hub_(hub),
        biases_(biases),
        turntable_(turntable),
        watchdog_(watchdog),
        recorder_(recorder),
        flight_(flight),
        certificates_(std::move(certificates)),
        state_folder_(std::move(state_folder)) {}

  grpc::Status GetRigInfo(grpc::ServerContext* context, const v1::GetRigInfoRequest* request,
                          v1::RigInfo* response) override;
  grpc::Status GetRigState(grpc::ServerContext* context, const v1::GetRigStateRequest* request,
                           v1::RigState* response) override;
  grpc::Status Diagnose(grpc::ServerContext* context, const v1::DiagnoseRequest* request,
                        v1::Diagnosis* response) override;
  grpc::Status BiasForceSensor(grpc::ServerContext* context, const v1::BiasForceSensorRequest* request,
                               v1::BiasForceSensorResponse* response) override;
  grpc::Status HomeDevice(grpc::ServerContext* context, const v1::HomeDeviceRequest* request,
                          v1::HomeDeviceResponse* response) override;

 private:
  Session& session_;
  const SceneHost& scenes_;
  TelemetryHub& hub_;
  SensorBiases& biases_;
  TurntableHost& turntable_;
  const Watchdog& watchdog_;
  Recorder& recorder_;
  const FlightRecorder& flight_;
  const std::string certificates_;  ///< folder; empty: served without
  const std::string state_folder_;  ///< where models are kept; empty: nowhere
  std::atomic<int> diagnoses_{0};
  std::atomic<int> bias_calls_{0};
};

}  // namespace hapticd::server
