#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {

/// The rig of D§4 with an object on it; in virtual time, unless real time is what a test is about.
inline server::DaemonConfig touching(const std::string& object, bool real_time = false) {
  server::DaemonConfig config = quiet_config();
  config.simulation.device = "phantom_1_5_high_force";
  config.simulation.object = object;
  config.simulation.real_time = real_time;
  return config;
}

/// Estimate of that name; a failure of the test if there is none.
inline const v1::EstimatedParameter& parameter_of(const v1::IdentificationProgress& progress,
                                                  const std::string& name) {
  for (const v1::EstimatedParameter& parameter : progress.parameters()) {
    if (parameter.name() == name) return parameter;
  }
  ADD_FAILURE() << "no parameter " << name << " in\n" << progress.ShortDebugString().substr(0, 2000);
  return v1::EstimatedParameter::default_instance();
}

/// A daemon, and what its clients do to identify something.
class Identifying : public RunningService {
 public:
  explicit Identifying(const server::DaemonConfig& config)
      : RunningService(config), stub(v1::IdentificationService::NewStub(channel)) {}

  grpc::Status start(const v1::StartIdentificationRequest& request, std::string* id = nullptr) const {
    v1::StartIdentificationResponse response;
    const grpc::Status status = stub->StartIdentification(call_context().get(), request, &response);
    if (id != nullptr) *id = response.identification();
    return status;
  }
  /// Watches until the stream ends or `enough` says so; the last message.
  v1::IdentificationProgress watch(
      const std::string& id = {},
      const std::function<bool(const v1::IdentificationProgress&)>& enough = {}) const {
    v1::WatchIdentificationRequest request;
    request.set_identification(id);
    const auto context = call_context();
    const auto reader = stub->WatchIdentification(context.get(), request);
    v1::IdentificationProgress progress;
    v1::IdentificationProgress next;
    while (reader->Read(&next)) {
      EXPECT_GE(next.completion(), progress.completion()) << "a progress bar never goes back";
      progress = next;
      if (enough && enough(progress)) {
        context->TryCancel();
        break;
      }
    }
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(enough || status.ok()) << status.error_message();
    return progress;
  }
  /// Starts it and watches to its end.
  v1::IdentificationProgress end_of(const v1::StartIdentificationRequest& request) const {
    std::string id;
    EXPECT_TRUE(ok(start(request, &id)));
    return watch(id);
  }
  grpc::Status cancel(v1::IdentificationProgress* progress = nullptr) const {
    v1::IdentificationProgress unused;
    return stub->CancelIdentification(call_context().get(), {}, progress != nullptr ? progress : &unused);
  }
  /// What was kept under the hash, or under its beginning.
  v1::StoredModel stored(const std::string& hash) const {
    v1::GetStoredModelRequest request;
    request.set_hash(hash);
    v1::StoredModel stored;
    EXPECT_TRUE(ok(model->GetStoredModel(call_context().get(), request, &stored)));
    return stored;
  }
  grpc::Status upload(const std::string& csv, v1::UploadRecordingResponse* response,
                      const v1::RecordingDescription& description = {}) const {
    const auto context = call_context();
    const auto writer = stub->UploadRecording(context.get(), response);
    v1::UploadRecordingRequest piece;
    *piece.mutable_description() = description;
    constexpr std::size_t kPiece = 1000;  // lines are cut anywhere
    for (std::size_t at = 0; at < csv.size() || at == 0; at += kPiece) {
      piece.set_csv(csv.substr(at, kPiece));
      if (!writer->Write(piece)) break;
      piece.clear_description();
    }
    writer->WritesDone();
    return writer->Finish();
  }

  std::unique_ptr<v1::IdentificationService::Stub> stub;
};

}  // namespace hapticd::test
