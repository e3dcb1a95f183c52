#include "server/grpc/recording/recording_service.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "server/access/lease_manager.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/recording/recording_messages.h"
#include "server/recording/exporter.h"
#include "server/recording/flight/flight_recorder.h"
#include "server/recording/recorder.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kPieceBytes = std::size_t{256} << 10U;

std::string who_calls() {
  const ServedCall* call = served_call();
  return call == nullptr ? std::string() : call->who.name;
}

Refusal no_lease_to_end_with() {
  return {RefusalKind::kFailedPrecondition,
          {"there is no lease with which the recording could end", "StartRecordingRequest.until_lease_ends",
           "true", "a client that holds the lease", "acquire the lease first, or leave this out"},
          Reason::kLeaseRequired};
}

Outcome<std::string> path_of(const std::string& id, v1::RecordingKind kind, Recorder& recorder,
                             FlightRecorder& flight) {
  return kind == v1::RECORDING_KIND_INCIDENT ? flight.path_of(id) : recorder.path_of(id);
}

/// A regular file, open for reading; not one that a link leads to.
class OpenFile {
 public:
  explicit OpenFile(const std::string& path)
      : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)) {
    if (descriptor_ < 0 || fstat(descriptor_, &status_) != 0) failure_ = errno;
    if (failure_ == 0 && !S_ISREG(status_.st_mode)) failure_ = EINVAL;
  }
  ~OpenFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  /// Error number of the failure; 0 if all is well.
  int failure() const { return failure_; }
  std::uint64_t size() const { return static_cast<std::uint64_t>(status_.st_size); }
  /// Fills `bytes`; false if there are not so many.
  bool take(std::string& bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t got = read(descriptor_, bytes.data() + done, bytes.size() - done);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

 private:
  int descriptor_;
  struct stat status_ {};
  int failure_ = 0;
};

/// Sends a file; what is appended meanwhile is left out.
grpc::Status send_file(const std::string& path, const Caller& caller,
                       grpc::ServerWriter<v1::RecordingPiece>* writer) {
  OpenFile file(path);
  const std::string id = std::filesystem::path(path).stem().string();
  if (file.failure() != 0) {
    return to_status({RefusalKind::kNotFound,
                      {"the file cannot be read", id, std::strerror(file.failure()), "a regular file",
                       "was it deleted just now?"}});
  }
  v1::RecordingPiece piece;
  piece.set_total_bytes(file.size());
  for (std::uint64_t left = file.size(); left > 0;) {
    if (caller.cancelled()) return grpc::Status::CANCELLED;
    std::string& data = *piece.mutable_data();
    data.resize(std::min<std::uint64_t>(left, kPieceBytes));
    if (!file.take(data)) {
      return to_status({RefusalKind::kInternal, {"the file cannot be read to its end", id, "", "", ""}});
    }
    left -= data.size();
    if (!writer->Write(piece)) return grpc::Status::CANCELLED;
    piece.Clear();
  }
  return grpc::Status::OK;
}

}  // namespace

grpc::Status RecordingService::StartRecording(grpc::ServerContext* context,
                                              const v1::StartRecordingRequest* request,
                                              v1::RecordingFile* response) {
  const auto channels = channels_of(*request);
  if (!channels) return to_status(channels.refusal());
  RecordingRequest wanted{request->name(), request->note(), who_calls(), *channels,
                          request->decimation() == 0 ? 1 : request->decimation()};
  if (request->until_lease_ends()) {
    const ServedCall* call = served_call();
    if (call == nullptr || !call->by_holder) return to_status(no_lease_to_end_with());
    wanted.is_over = [leases = call->leases, number = call->lease]() -> std::optional<hal::Error> {
      const auto why = leases->lost(number);
      return why ? std::optional(why->error) : std::nullopt;
    };
  }
  const auto started = recorder_.start(wanted);
  if (!started) return to_status(started.refusal());
  log_call("recording '" + started->id + "' was started", *context);
  fill(*started, v1::RECORDING_KIND_RECORDING, *response);
  return grpc::Status::OK;
}

grpc::Status RecordingService::StopRecording(grpc::ServerContext* context, const v1::StopRecordingRequest*,
                                             v1::RecordingFile* response) {
  const auto stopped = recorder_.stop(who_calls());
  if (!stopped) return to_status(stopped.refusal());
  log_call("recording '" + stopped->id + "' was stopped", *context);
  fill(*stopped, v1::RECORDING_KIND_RECORDING, *response);
  return grpc::Status::OK;
}

grpc::Status RecordingService::Annotate(grpc::ServerContext*, const v1::AnnotateRequest* request,
                                        v1::AnnotateResponse*) {
  const auto refusal = recorder_.annotate(request->text(), who_calls());
  return refusal ? to_status(*refusal) : grpc::Status::OK;
}

grpc::Status RecordingService::ListRecordings(grpc::ServerContext*, const v1::ListRecordingsRequest* request,
                                              v1::ListRecordingsResponse* response) {
  const bool incidents = request->kind() == v1::RECORDING_KIND_INCIDENT;
  const auto list = incidents ? flight_.list() : recorder_.list();
  if (!list) return to_status(list.refusal());
  const auto kind = incidents ? v1::RECORDING_KIND_INCIDENT : v1::RECORDING_KIND_RECORDING;
  for (const RecordingInfo& info : *list) fill(info, kind, *response->add_recordings());
  response->set_folder(folder_ + (incidents ? "/incidents" : "/recordings"));
  return grpc::Status::OK;
}

grpc::Status RecordingService::GetRecording(grpc::ServerContext* context,
                                            const v1::GetRecordingRequest* request,
                                            grpc::ServerWriter<v1::RecordingPiece>* writer) {
  const CountedCall counted(downloads_, kMaxDownloads);
  if (!counted.admitted()) return counted.refusal("downloads", "GetRecording");
  const auto path = path_of(request->id(), request->kind(), recorder_, flight_);
  if (!path) return to_status(path.refusal());
  return send_file(*path, caller_of(*context), writer);
}

grpc::Status RecordingService::ExportRecording(grpc::ServerContext* context,
                                               const v1::ExportRecordingRequest* request,
                                               grpc::ServerWriter<v1::RecordingPiece>* writer) {
  const CountedCall counted(exports_, kMaxExports);
  if (!counted.admitted()) return counted.refusal("exports", "ExportRecording");
  const auto path = path_of(request->id(), request->kind(), recorder_, flight_);
  if (!path) return to_status(path.refusal());
  if (request->format() != v1::EXPORT_FORMAT_HDF5 && request->format() != v1::EXPORT_FORMAT_CSV) {
    return to_status({RefusalKind::kInvalidArgument,
                      {"unknown format", "ExportRecordingRequest.format",
                       std::to_string(static_cast<int>(request->format())), "HDF5 or CSV", ""}});
  }
  ExportOrder order;
  order.format = request->format() == v1::EXPORT_FORMAT_CSV ? "csv" : "hdf5";
  order.columns.assign(request->columns().begin(), request->columns().end());
  order.from_s = request->from_s();
  order.to_s = request->to_s();
  order.decimation = request->decimation() == 0 ? 1 : request->decimation();
  const Caller caller = caller_of(*context);
  const auto table =
      export_recording(*path, folder_, recorder_.folder().limits().keep_free_mb, order, caller);
  if (!table) return to_status(table.refusal());
  return send_file(table->path(), caller, writer);
}

grpc::Status RecordingService::DeleteRecording(grpc::ServerContext* context,
                                               const v1::DeleteRecordingRequest* request,
                                               v1::RecordingFile* response) {
  const bool incident = request->kind() == v1::RECORDING_KIND_INCIDENT;
  const auto removed = incident ? flight_.remove(request->id()) : recorder_.remove(request->id());
  if (!removed) return to_status(removed.refusal());
  log_call("recording '" + removed->id + "' was deleted", *context);
  fill(*removed, incident ? v1::RECORDING_KIND_INCIDENT : v1::RECORDING_KIND_RECORDING, *response);
  return grpc::Status::OK;
}

grpc::Status RecordingService::MakeIncident(grpc::ServerContext*, const v1::MakeIncidentRequest* request,
                                            v1::MakeIncidentResponse*) {
  const auto refusal = flight_.request(request->reason(), who_calls());
  return refusal ? to_status(*refusal) : grpc::Status::OK;
}

}  // namespace hapticd::server
