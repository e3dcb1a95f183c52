#include "server/grpc/experiment/experiment_service.h"

#include "server/access/lease_manager.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxBytes = 4096;

bool is_over(const v1::ExperimentProgress& progress) {
  return progress.phase() == v1::EXPERIMENT_PHASE_DONE || progress.phase() == v1::EXPERIMENT_PHASE_ABORTED;
}

}  // namespace

grpc::Status ExperimentService::ReportExperiment(grpc::ServerContext*, const v1::ExperimentProgress* request,
                                                 v1::ReportExperimentResponse*) {
  if (request->ByteSizeLong() > kMaxBytes) {
    return to_status(
        {RefusalKind::kInvalidArgument,
         {"the report is too long", "ExperimentProgress", std::to_string(request->ByteSizeLong()) + " bytes",
          std::to_string(kMaxBytes) + " bytes", "shorten its texts"}});
  }
  const ServedCall& call = *served_call();
  const auto admitted = leases_.admit(call.who, call.token, LeaseRule::kRequired);
  if (!admitted) return to_status(admitted.refusal());
  const MutexLock lock(mutex_);
  last_ = Report{*request, call.who.name, Clock::now()};
  return grpc::Status::OK;
}

grpc::Status ExperimentService::GetExperiment(grpc::ServerContext*, const v1::GetExperimentRequest*,
                                              v1::ExperimentState* response) {
  const MutexLock lock(mutex_);
  if (!last_) return grpc::Status::OK;
  const auto age = Clock::now() - last_->time;
  *response->mutable_progress() = last_->progress;
  response->set_by(last_->by);
  response->set_age_s(std::chrono::duration<double>(age).count());
  response->set_is_running(age < kSilence && !is_over(last_->progress));
  return grpc::Status::OK;
}

}  // namespace hapticd::server
