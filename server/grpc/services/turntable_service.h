#pragma once

#include "hapticd/v1/turntable.grpc.pb.h"

namespace hapticd::server {

class TurntableHost;

/// StopTurntable uses the callback interface: it needs no thread of the pool, which other calls may have used
/// up.
class TurntableService final
    : public v1::TurntableService::WithCallbackMethod_StopTurntable<v1::TurntableService::Service> {
 public:
  explicit TurntableService(TurntableHost& host) : host_(host) {}

  grpc::Status GetTurntable(grpc::ServerContext* context, const v1::GetTurntableRequest* request,
                            v1::Turntable* response) override;
  grpc::Status Home(grpc::ServerContext* context, const v1::HomeRequest* request,
                    grpc::ServerWriter<v1::TurntableStatus>* writer) override;
  grpc::Status MoveTo(grpc::ServerContext* context, const v1::MoveToRequest* request,
                      grpc::ServerWriter<v1::TurntableStatus>* writer) override;
  grpc::ServerUnaryReactor* StopTurntable(grpc::CallbackServerContext* context,
                                          const v1::StopTurntableRequest* request,
                                          v1::TurntableStatus* response) override;
  grpc::Status ClearAlarm(grpc::ServerContext* context, const v1::ClearAlarmRequest* request,
                          v1::TurntableStatus* response) override;
  grpc::Status Engage(grpc::ServerContext* context, const v1::EngageRequest* request,
                      v1::TurntableStatus* response) override;
  grpc::Status Disengage(grpc::ServerContext* context, const v1::DisengageRequest* request,
                         v1::TurntableStatus* response) override;

 private:
  TurntableHost& host_;
};

}  // namespace hapticd::server
