#pragma once

#include <string>

#include "hapticd/v1/clock.grpc.pb.h"

namespace hapticd::server {

class Session;

/// Exchange uses the callback interface: a call that waits for a thread would only widen the bounds.
class ClockService final : public v1::ClockService::WithCallbackMethod_Exchange<v1::ClockService::Service> {
 public:
  explicit ClockService(const Session& session);

  grpc::ServerUnaryReactor* Exchange(grpc::CallbackServerContext* context, const v1::ExchangeRequest* request,
                                     v1::ExchangeResponse* response) override;
  grpc::Status GetClock(grpc::ServerContext* context, const v1::GetClockRequest* request,
                        v1::ClockState* response) override;

 private:
  const Session& session_;
  const std::string clock_;      ///< see ExchangeResponse.clock
  const std::string rig_clock_;  ///< see RigReading.clock
};

}  // namespace hapticd::server
