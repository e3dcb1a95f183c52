#pragma once

// Internal to the library: the gRPC side of an upload.

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "client/cpp/recording_upload.h"
#include "hapticd/v1/identification.grpc.pb.h"

namespace hapticd::client {

struct RecordingUpload::State {
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::RecordingDescription& description,
        std::string server_address);
  ~State();
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// The operation in progress. One at a time, so the completion queue needs no tags.
  enum class Phase {
    kStarting,   ///< the call, then the piece that waits for it
    kIdle,       ///< ready for a piece
    kWriting,    ///< a piece
    kClosing,    ///< the end of the pieces
    kFinishing,  ///< the answer
    kDone,
  };

  /// Goes on until `goal` is reached or passed; false when `wait` passed first. Throws what the daemon
  /// refused.
  bool advance(Phase goal, std::chrono::milliseconds wait);
  /// Begins, from kIdle, the piece that waits, else the end of the upload if that waits.
  void begin_next();
  void on_completed(bool succeeded);

  std::string address;
  std::unique_ptr<v1::IdentificationService::Stub> stub;
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  grpc::Status status;
  v1::UploadRecordingResponse response;
  v1::UploadRecordingRequest outgoing;
  bool piece_waits = false;
  bool close_waits = false;
  Phase phase = Phase::kStarting;
  std::unique_ptr<grpc::ClientAsyncWriter<v1::UploadRecordingRequest>> writer;
};

}  // namespace hapticd::client
