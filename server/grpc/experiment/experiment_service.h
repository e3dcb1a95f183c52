#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "hal/lock/mutex.h"
#include "hapticd/v1/experiment.grpc.pb.h"

namespace hapticd::server {

class LeaseManager;

/// Keeps what the program that runs an experiment last reported of its session.
class ExperimentService final : public v1::ExperimentService::Service {
 public:
  /// A program that was not heard of for so long does not run any more.
  static constexpr std::chrono::seconds kSilence{5};

  explicit ExperimentService(LeaseManager& leases) : leases_(leases) {}

  grpc::Status ReportExperiment(grpc::ServerContext* context, const v1::ExperimentProgress* request,
                                v1::ReportExperimentResponse* response) override;
  grpc::Status GetExperiment(grpc::ServerContext* context, const v1::GetExperimentRequest* request,
                             v1::ExperimentState* response) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Report {
    v1::ExperimentProgress progress;
    std::string by;
    Clock::time_point time;
  };

  LeaseManager& leases_;
  Mutex mutex_;
  std::optional<Report> last_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
