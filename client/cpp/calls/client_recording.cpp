// Recordings and incidents of the daemon, and what happened on the rig.

#include "client/cpp/client.h"
#include "client/cpp/client_state.h"

namespace hapticd::client {
namespace {

/// The last chunk, the summary, and a disk that takes its time.
constexpr std::chrono::seconds kFinishingFile{10};

}  // namespace

v1::RecordingFile Client::start_recording(const v1::StartRecordingRequest& request) {
  return state_->call(&v1::RecordingService::Stub::StartRecording, request);
}

v1::RecordingFile Client::stop_recording() {
  return state_->call(&v1::RecordingService::Stub::StopRecording, v1::StopRecordingRequest(), kFinishingFile);
}

void Client::annotate_recording(const std::string& text) {
  v1::AnnotateRequest request;
  request.set_text(text);
  state_->call(&v1::RecordingService::Stub::Annotate, request);
}

v1::ListRecordingsResponse Client::recordings(v1::RecordingKind kind) {
  v1::ListRecordingsRequest request;
  request.set_kind(kind);
  return state_->call(&v1::RecordingService::Stub::ListRecordings, request);
}

v1::ListEventsResponse Client::events(const v1::ListEventsRequest& request) {
  return state_->call(&v1::EventService::Stub::ListEvents, request);
}

EventStream Client::watch_events(const v1::WatchEventsRequest& request) {
  return EventStream(state_->stream(&v1::EventService::Stub::AsyncWatchEvents, request));
}

RecordingStream Client::get_recording(const v1::GetRecordingRequest& request) {
  return RecordingStream(state_->stream(&v1::RecordingService::Stub::AsyncGetRecording, request));
}

RecordingStream Client::export_recording(const v1::ExportRecordingRequest& request) {
  return RecordingStream(state_->stream(&v1::RecordingService::Stub::AsyncExportRecording, request));
}

v1::RecordingFile Client::delete_recording(const v1::DeleteRecordingRequest& request) {
  return state_->call(&v1::RecordingService::Stub::DeleteRecording, request);
}

void Client::make_incident(const std::string& reason) {
  v1::MakeIncidentRequest request;
  request.set_reason(reason);
  state_->call(&v1::RecordingService::Stub::MakeIncident, request);
}

}  // namespace hapticd::client
