#include "client/cpp/recording_upload.h"

#include <algorithm>
#include <utility>

#include "client/cpp/error.h"
#include "client/cpp/recording_upload_state.h"

namespace hapticd::client {

namespace {

/// The daemon ends such a call without a reason; this one is added here.
Error given_up_by_daemon(const std::string& address) {
  v1::ErrorDetail detail;
  detail.set_what("the daemon ended the upload");
  detail.set_where(address);
  detail.set_limit("a piece at least every 30 s");
  detail.set_remedy("send it without pauses, e.g. from a file; see also the daemon's log");
  return {ErrorKind::kRefused, "CANCELLED", detail};
}

}  // namespace

RecordingUpload::State::State(const std::shared_ptr<grpc::Channel>& channel,
                              const v1::RecordingDescription& description, std::string server_address)
    : address(std::move(server_address)),
      stub(v1::IdentificationService::NewStub(channel)),
      writer(stub->AsyncUploadRecording(&context, &response, &queue, nullptr)) {
  *outgoing.mutable_description() = description;
}

RecordingUpload::State::~State() {
  context.TryCancel();
  void* tag = nullptr;
  bool succeeded = false;
  if (phase != Phase::kDone) {
    if (phase != Phase::kIdle && phase != Phase::kFinishing) queue.Next(&tag, &succeeded);
    if (phase != Phase::kFinishing) writer->Finish(&status, nullptr);
    queue.Next(&tag, &succeeded);
  }
  queue.Shutdown();
  while (queue.Next(&tag, &succeeded)) {
  }
}

void RecordingUpload::State::begin_next() {
  if (piece_waits) {
    piece_waits = false;
    phase = Phase::kWriting;
    writer->Write(outgoing, nullptr);
  } else if (close_waits) {
    phase = Phase::kClosing;
    writer->WritesDone(nullptr);
  }
}

void RecordingUpload::State::on_completed(bool succeeded) {
  if (phase == Phase::kFinishing) {
    phase = Phase::kDone;
    return;
  }
  if (!succeeded || phase == Phase::kClosing) {
    // A piece that was not taken: the status says why.
    phase = Phase::kFinishing;
    writer->Finish(&status, nullptr);
    return;
  }
  if (phase == Phase::kWriting) outgoing.Clear();
  phase = Phase::kIdle;
  begin_next();
}

bool RecordingUpload::State::advance(Phase goal, std::chrono::milliseconds wait) {
  const auto until = std::chrono::steady_clock::now() + wait;
  while (phase != goal && phase != Phase::kDone) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    void* tag = nullptr;
    bool succeeded = false;
    const auto deadline = std::chrono::system_clock::now() + std::max(left, std::chrono::milliseconds(0));
    if (queue.AsyncNext(&tag, &succeeded, deadline) != grpc::CompletionQueue::GOT_EVENT) return false;
    on_completed(succeeded);
  }
  if (phase == Phase::kDone && status.error_code() == grpc::StatusCode::CANCELLED)
    throw given_up_by_daemon(address);
  if (phase == Phase::kDone && !status.ok()) {
    throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                            status.error_details(), address);
  }
  return true;
}

RecordingUpload::RecordingUpload(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingUpload::RecordingUpload(RecordingUpload&&) noexcept = default;
RecordingUpload& RecordingUpload::operator=(RecordingUpload&&) noexcept = default;
RecordingUpload::~RecordingUpload() = default;

void RecordingUpload::send(std::string csv) {
  state_->outgoing.set_csv(std::move(csv));
  state_->piece_waits = true;
  if (state_->phase == State::Phase::kIdle) state_->begin_next();
}

bool RecordingUpload::taken(std::chrono::milliseconds wait) {
  return state_->advance(State::Phase::kIdle, wait);
}

void RecordingUpload::finish() {
  // A text without a single piece still has its description.
  if (state_->outgoing.has_description()) state_->piece_waits = true;
  state_->close_waits = true;
  if (state_->phase == State::Phase::kIdle) state_->begin_next();
}

std::optional<v1::UploadRecordingResponse> RecordingUpload::answer(std::chrono::milliseconds wait) {
  if (!state_->advance(State::Phase::kDone, wait)) return std::nullopt;
  return state_->response;
}

}  // namespace hapticd::client
