#pragma once

#include <atomic>
#include <chrono>

#include "hapticd/v1/calibration.grpc.pb.h"
#include "server/grpc/calls/counted_call.h"

namespace hapticd::server {

class CalibrationRunner;

class CalibrationService final : public v1::CalibrationService::Service {
 public:
  /// Streams at once; each holds one of the server's threads.
  static constexpr int kMaxWatchers = 8;
  static constexpr int kMaxPushers = 2;
  /// A stream of poses that sends nothing for so long is ended.
  static constexpr std::chrono::seconds kMaxPause{30};

  explicit CalibrationService(CalibrationRunner& runner) : runner_(runner) {}

  grpc::Status StartCalibration(grpc::ServerContext* context, const v1::StartCalibrationRequest* request,
                                v1::StartCalibrationResponse* response) override;
  grpc::Status PushReferencePoses(grpc::ServerContext* context,
                                  grpc::ServerReader<v1::PushReferencePosesRequest>* reader,
                                  v1::PushReferencePosesResponse* response) override;
  grpc::Status FinishCalibration(grpc::ServerContext* context, const v1::FinishCalibrationRequest* request,
                                 v1::CalibrationProgress* response) override;
  grpc::Status WatchCalibration(grpc::ServerContext* context, const v1::WatchCalibrationRequest* request,
                                grpc::ServerWriter<v1::CalibrationProgress>* writer) override;
  grpc::Status CancelCalibration(grpc::ServerContext* context, const v1::CancelCalibrationRequest* request,
                                 v1::CalibrationProgress* response) override;
  grpc::Status ListCalibrations(grpc::ServerContext* context, const v1::ListCalibrationsRequest* request,
                                v1::ListCalibrationsResponse* response) override;
  grpc::Status GetCalibration(grpc::ServerContext* context, const v1::GetCalibrationRequest* request,
                              v1::Calibration* response) override;
  grpc::Status AdoptCalibration(grpc::ServerContext* context, const v1::AdoptCalibrationRequest* request,
                                v1::AdoptCalibrationResponse* response) override;
  grpc::Status DeleteCalibration(grpc::ServerContext* context, const v1::DeleteCalibrationRequest* request,
                                 v1::DeleteCalibrationResponse* response) override;

 private:
  CalibrationRunner& runner_;
  SharedPlaces watchers_{kMaxWatchers};
  std::atomic<int> pushers_{0};
};

}  // namespace hapticd::server
