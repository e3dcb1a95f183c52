#pragma once

#include "hapticd/v1/safety.grpc.pb.h"
#include "proto/text/report_rate.h"
#include "server/grpc/calls/stop_request.h"
#include "server/grpc/calls/wait_queue.h"

namespace hapticd::server {

class SafetyLatch;

/// Stop and Clear use the callback interface: they need no thread of the pool, which waiting calls may have
/// used up.
class SafetyService final : public v1::SafetyService::WithCallbackMethod_Clear<v1::SafetyService::Service> {
 public:
  explicit SafetyService(SafetyLatch& latch) : latch_(latch) {}

  /// Stop, which is called as soon as its headers are there. `request`: nullptr if it did not come.
  grpc::Status stop(const grpc::CallbackServerContext& context, const grpc::ByteBuffer* request,
                    grpc::ByteBuffer& response);
  grpc::ServerUnaryReactor* Clear(grpc::CallbackServerContext* context, const v1::ClearRequest* request,
                                  v1::ClearResponse* response) override;
  grpc::Status ListFaults(grpc::ServerContext* context, const v1::ListFaultsRequest* request,
                          v1::ListFaultsResponse* response) override;

 private:
  static constexpr int kMaxNotedPerS = 20;

  /// Writes it to the log and to the audit log. `unreported`: see ReportRate.
  static void note_stop(const StopReason& reason, std::uint64_t unreported, std::uint64_t last_tick,
                        const grpc::CallbackServerContext& context);

  SafetyLatch& latch_;
  // Counted apart, so that requests that cannot be read do not hide who stopped.
  text::ReportRate noted_{kMaxNotedPerS};
  text::ReportRate noted_unreadable_{kMaxNotedPerS};
  WaitQueue clears_{"hapticd-clear"};
};

}  // namespace hapticd::server
