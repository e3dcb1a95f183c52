#pragma once

#include <atomic>
#include <chrono>

#include "hapticd/v1/identification.grpc.pb.h"
#include "server/grpc/calls/counted_call.h"

namespace hapticd::server {

class IdentificationRunner;

class IdentificationService final : public v1::IdentificationService::Service {
 public:
  /// Streams of progress at once; more are refused, since each holds one of the server's threads.
  static constexpr int kMaxWatchers = 16;
  /// Maximum number of uploads of recordings at once.
  static constexpr int kMaxUploads = 4;
  /// An upload that sends nothing for so long is ended.
  static constexpr std::chrono::seconds kMaxUploadPause{30};

  explicit IdentificationService(IdentificationRunner& runner) : runner_(runner) {}

  grpc::Status StartIdentification(grpc::ServerContext* context,
                                   const v1::StartIdentificationRequest* request,
                                   v1::StartIdentificationResponse* response) override;
  grpc::Status WatchIdentification(grpc::ServerContext* context,
                                   const v1::WatchIdentificationRequest* request,
                                   grpc::ServerWriter<v1::IdentificationProgress>* writer) override;
  grpc::Status CancelIdentification(grpc::ServerContext* context,
                                    const v1::CancelIdentificationRequest* request,
                                    v1::IdentificationProgress* response) override;
  grpc::Status ListIdentifications(grpc::ServerContext* context,
                                   const v1::ListIdentificationsRequest* request,
                                   v1::ListIdentificationsResponse* response) override;
  grpc::Status UploadRecording(grpc::ServerContext* context,
                               grpc::ServerReader<v1::UploadRecordingRequest>* reader,
                               v1::UploadRecordingResponse* response) override;

 private:
  IdentificationRunner& runner_;
  SharedPlaces watchers_{kMaxWatchers};
  std::atomic<int> uploads_{0};
};

}  // namespace hapticd::server
