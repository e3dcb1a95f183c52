#include "server/grpc/services/identification_service.h"

#include <fmt/format.h>

#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/calls/progress_stream.h"
#include "server/grpc/calls/silence_monitor.h"
#include "server/grpc/messages/identification_messages.h"
#include "server/grpc/messages/status.h"
#include "server/identification/run/identification_runner.h"
#include "server/process/log.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

/// Bytes of a remark: it may quote a recording, whose lines may have any length.
constexpr std::size_t kMaxRemark = 1000;

/// Describes what a recording can be read as, and how long it is; if it can be read as nothing known, what is
/// missing.
void describe(const StoredRecording& recording, v1::UploadRecordingResponse& response) {
  response.set_recording(recording.id);
  response.set_rows(recording.rows);
  response.set_sha256(recording.sha256);
  std::string why;
  for (const RecordedMotion motion : {RecordedMotion::kPress, RecordedMotion::kStroke, RecordedMotion::kFree,
                                      RecordedMotion::kBend, RecordedMotion::kRigid}) {
    const auto rows = RecordedObservations::open(recording.file.path(), motion, recording.description);
    if (rows) {
      for (const std::string& own : rows->own_columns()) {
        response.add_remarks(shortened(repaired_utf8("a recording of hapticd's own: " + own), kMaxRemark));
      }
      const RecordingSummary& summary = rows->summary();
      response.set_duration_s(summary.duration_s);
      if (summary.longest_step_s > 5.0 * summary.median_step_s) {
        response.add_remarks(fmt::format("the longest step is {:g} s, the median {:g} s",
                                         summary.longest_step_s, summary.median_step_s));
      }
      return;
    }
    if (why.empty()) why = rows.error().text();
  }
  response.add_remarks(shortened(repaired_utf8("not readable as it is: " + why), kMaxRemark));
}

/// Ends an upload that has gone silent: the client sees CANCELLED, whatever is answered; the log shows why.
grpc::Status gone_silent(const std::string& name) {
  log_warning(fmt::format("the upload of recording '{}' is given up: nothing came for {} s",
                          repaired_utf8(name),
                          std::chrono::seconds(IdentificationService::kMaxUploadPause).count()));
  return grpc::Status::CANCELLED;
}

}  // namespace

grpc::Status IdentificationService::StartIdentification(grpc::ServerContext* context,
                                                        const v1::StartIdentificationRequest* request,
                                                        v1::StartIdentificationResponse* response) {
  const auto wanted = read_request(*request);
  if (!wanted) return to_status(wanted.refusal());
  const Caller caller = caller_of(*context);
  const auto id = runner_.start(*wanted, caller.lease);
  if (!id) return to_status(id.refusal());
  // Control may have changed hands just before it began.
  if (const auto lost = caller.lost()) runner_.end_under(caller.lease, lost->error);
  log_call("identification '" + *id + "' was started", *context);
  response->set_identification(*id);
  return grpc::Status::OK;
}

grpc::Status IdentificationService::WatchIdentification(
    grpc::ServerContext* context, const v1::WatchIdentificationRequest* request,
    grpc::ServerWriter<v1::IdentificationProgress>* writer) {
  const PlacedCall counted(watchers_);
  if (!counted.admitted()) return counted.refusal("watchers", "WatchIdentification");
  return stream_progress(
      runner_, request->identification(), caller_of(*context), *writer,
      [](const IdentificationReport& report) { return report.state != IdentificationState::kRunning; });
}

grpc::Status IdentificationService::CancelIdentification(grpc::ServerContext* context,
                                                         const v1::CancelIdentificationRequest* request,
                                                         v1::IdentificationProgress* response) {
  const auto report = runner_.cancel(request->identification(), caller_of(*context));
  if (!report) return to_status(report.refusal());
  fill(*report, *response);
  return grpc::Status::OK;
}

grpc::Status IdentificationService::ListIdentifications(grpc::ServerContext*,
                                                        const v1::ListIdentificationsRequest*,
                                                        v1::ListIdentificationsResponse* response) {
  for (const IdentificationReport& report : runner_.list()) fill(report, *response->add_identifications());
  return grpc::Status::OK;
}

grpc::Status IdentificationService::UploadRecording(grpc::ServerContext* context,
                                                    grpc::ServerReader<v1::UploadRecordingRequest>* reader,
                                                    v1::UploadRecordingResponse* response) {
  const CountedCall counted(uploads_, kMaxUploads);
  if (!counted.admitted()) return counted.refusal("uploads", "UploadRecording");
  SilenceMonitor watch(kMaxUploadPause, [context] { context->TryCancel(); });
  v1::UploadRecordingRequest piece;
  const auto next_piece = [&] { return watch.during([&] { return reader->Read(&piece); }); };
  if (!next_piece() || !piece.has_description()) {
    if (watch.was_silent()) return gone_silent(piece.description().name());
    return to_status({RefusalKind::kInvalidArgument,
                      {"the first message has no description", "UploadRecordingRequest.description", "", "",
                       "send a description first, then the text"}});
  }
  const auto description = read_description(piece.description());
  if (!description) return to_status(description.refusal());
  auto upload = runner_.recordings().begin(*description, piece.description().normal_force_n());
  if (!upload) return to_status(upload.refusal());
  do {
    if (auto refusal = (*upload)->append(piece.csv())) return to_status(*refusal);
  } while (next_piece());
  if (watch.was_silent()) return gone_silent(description->name);
  if (context->IsCancelled()) return grpc::Status::CANCELLED;  // the end of the recording never arrived
  const auto recording = runner_.recordings().finish(std::move(*upload));
  if (!recording) return to_status(recording.refusal());
  describe(**recording, *response);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
