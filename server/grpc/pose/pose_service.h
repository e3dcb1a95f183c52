#pragma once

#include "hapticd/v1/pose.grpc.pb.h"

namespace hapticd::pose {
class PosePublisher;
}

namespace hapticd::server {

/// One stream per subscriber, by the callback interface: a waiting stream holds no thread. Raw, so that a
/// pose for several subscribers is encoded once.
class PoseService final : public v1::PoseService::WithRawCallbackMethod_Subscribe<v1::PoseService::Service> {
 public:
  explicit PoseService(pose::PosePublisher& publisher) : publisher_(publisher) {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Subscribe(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;

 private:
  pose::PosePublisher& publisher_;
};

}  // namespace hapticd::server
