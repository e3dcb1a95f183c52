#include "server/grpc/calibration/calibration_service.h"

#include "server/calibration/run/calibration_runner.h"
#include "server/grpc/calibration/calibration_messages.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/calls/progress_stream.h"
#include "server/grpc/calls/silence_monitor.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

grpc::Status CalibrationService::StartCalibration(grpc::ServerContext* context,
                                                  const v1::StartCalibrationRequest* request,
                                                  v1::StartCalibrationResponse* response) {
  const auto wanted = read_request(*request);
  if (!wanted) return to_status(wanted.refusal());
  const Caller caller = caller_of(*context);
  const auto id = runner_.start(*wanted, caller.lease);
  if (!id) return to_status(id.refusal());
  // Control may have changed hands just before it began.
  if (const auto lost = caller.lost()) runner_.end_under(caller.lease, lost->error);
  log_call("calibration '" + *id + "' was started", *context);
  response->set_calibration(*id);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::PushReferencePoses(grpc::ServerContext* context,
                                                    grpc::ServerReader<v1::PushReferencePosesRequest>* reader,
                                                    v1::PushReferencePosesResponse* response) {
  const CountedCall counted(pushers_, kMaxPushers);
  if (!counted.admitted()) return counted.refusal("streams of poses", "PushReferencePoses");
  SilenceMonitor watch(kMaxPause, [context] { context->TryCancel(); });
  v1::PushReferencePosesRequest piece;
  std::uint64_t poses = 0;
  std::uint64_t rig_poses = 0;
  while (watch.during([&] { return reader->Read(&piece); })) {
    const auto reference = read_poses(piece);
    if (!reference) return to_status(reference.refusal());
    const auto rig = read_rig_poses(piece);
    if (!rig) return to_status(rig.refusal());
    if (auto refusal = runner_.push(*reference, *rig)) {
      // The calibration was over before the client that pushes.
      if (refusal->kind == RefusalKind::kFailedPrecondition && poses + rig_poses > 0) break;
      return to_status(*refusal);
    }
    poses += reference->size();
    rig_poses += rig->size();
  }
  if (watch.was_silent() || context->IsCancelled()) return grpc::Status::CANCELLED;
  response->set_poses(poses);
  response->set_rig_poses(rig_poses);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::FinishCalibration(grpc::ServerContext* context,
                                                   const v1::FinishCalibrationRequest*,
                                                   v1::CalibrationProgress* response) {
  const auto report = runner_.finish(caller_of(*context));
  if (!report) return to_status(report.refusal());
  fill(*report, *response);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::CancelCalibration(grpc::ServerContext* context,
                                                   const v1::CancelCalibrationRequest*,
                                                   v1::CalibrationProgress* response) {
  const auto report = runner_.cancel(caller_of(*context));
  if (!report) return to_status(report.refusal());
  fill(*report, *response);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::WatchCalibration(grpc::ServerContext* context,
                                                  const v1::WatchCalibrationRequest* request,
                                                  grpc::ServerWriter<v1::CalibrationProgress>* writer) {
  const PlacedCall counted(watchers_);
  if (!counted.admitted()) return counted.refusal("watchers", "WatchCalibration");
  return stream_progress(runner_, request->calibration(), caller_of(*context), *writer,
                         [](const CalibrationReport& report) { return report.over(); });
}

grpc::Status CalibrationService::ListCalibrations(grpc::ServerContext*, const v1::ListCalibrationsRequest*,
                                                  v1::ListCalibrationsResponse* response) {
  const std::string adopted = runner_.store().adopted_hash();
  for (const StoredCalibration& stored : runner_.store().list()) {
    v1::Calibration& message = *response->add_calibrations();
    fill(stored, stored.hash == adopted, message);
    message.clear_target_error();  // of one alone: GetCalibration
  }
  return grpc::Status::OK;
}

grpc::Status CalibrationService::GetCalibration(grpc::ServerContext*,
                                                const v1::GetCalibrationRequest* request,
                                                v1::Calibration* response) {
  const auto stored = runner_.store().find(request->hash());
  if (!stored) return to_status(stored.refusal());
  fill(*stored, stored->hash == runner_.store().adopted_hash(), *response);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::AdoptCalibration(grpc::ServerContext* context,
                                                  const v1::AdoptCalibrationRequest* request,
                                                  v1::AdoptCalibrationResponse* response) {
  const auto adopted = runner_.store().adopt(request->hash());
  if (!adopted) return to_status(adopted.refusal());
  log_call(
      adopted->empty() ? "no calibration is adopted any more" : "calibration " + *adopted + " was adopted",
      *context);
  response->set_hash(*adopted);
  return grpc::Status::OK;
}

grpc::Status CalibrationService::DeleteCalibration(grpc::ServerContext* context,
                                                   const v1::DeleteCalibrationRequest* request,
                                                   v1::DeleteCalibrationResponse*) {
  if (auto refusal = runner_.store().remove(request->hash())) return to_status(*refusal);
  log_call("calibration " + request->hash() + " was deleted", *context);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
