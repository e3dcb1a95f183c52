#include "server/grpc/services/clock_service.h"

#include "server/process/system_clock.h"
#include "server/session/session.h"

namespace hapticd::server {

namespace {

v1::UtcState to_proto(UtcKeeping state) {
  switch (state) {
    case UtcKeeping::kUnknown:
      return v1::UTC_STATE_UNKNOWN;
    case UtcKeeping::kSynchronized:
      return v1::UTC_STATE_SYNCHRONIZED;
    case UtcKeeping::kUnsynchronized:
      return v1::UTC_STATE_UNSYNCHRONIZED;
  }
  return v1::UTC_STATE_UNKNOWN;
}

}  // namespace

ClockService::ClockService(const Session& session)
    : session_(session), clock_(boot_name()), rig_clock_(clock_ + "/" + std::to_string(monotonic_ns())) {}

grpc::ServerUnaryReactor* ClockService::Exchange(grpc::CallbackServerContext* context,
                                                 const v1::ExchangeRequest* request,
                                                 v1::ExchangeResponse* response) {
  response->set_daemon_received_ns(monotonic_ns());
  response->set_client_sent_ns(request->client_sent_ns());
  response->set_clock(clock_);
  // A recording leaves out the time for which the loop is late.
  const bool has_own_time = session_.rig_info().kind == hal::RigKind::kReplay;
  if (const auto reading = session_.last_reading(); reading && !has_own_time) {
    v1::RigReading& rig = *response->mutable_rig();
    rig.set_rig_time_ns(reading->rig_time_ns);
    rig.set_begun_ns(reading->begun_ns);
    rig.set_done_ns(reading->done_ns);
    rig.set_clock(rig_clock_);
  }
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  response->set_daemon_sent_ns(monotonic_ns());
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::Status ClockService::GetClock(grpc::ServerContext*, const v1::GetClockRequest*,
                                    v1::ClockState* response) {
  const ClockReading reading = read_clocks();
  response->set_clock(clock_);
  response->set_monotonic_ns(reading.monotonic_ns);
  response->set_utc_ns(reading.utc_ns);
  response->set_read_apart_ns(reading.apart_ns);
  response->set_rig_time_ns(session_.now_ns());
  const KernelClock kernel = kernel_clock();
  response->set_utc_state(to_proto(kernel.utc));
  if (kernel.max_error_ms) response->set_utc_max_error_ms(*kernel.max_error_ms);
  if (kernel.frequency_ppm) response->set_kernel_frequency_ppm(*kernel.frequency_ppm);
  for (const std::string& name : clock_keepers()) response->add_kept_by(name);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
