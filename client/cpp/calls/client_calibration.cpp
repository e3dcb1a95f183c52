// Calibrations by a visual system.

#include "client/cpp/client.h"
#include "client/cpp/client_state.h"

namespace hapticd::client {
namespace {

/// The fit of a long motion on a busy machine.
constexpr std::chrono::seconds kFitting{120};

}  // namespace

v1::StartCalibrationResponse Client::start_calibration(const v1::StartCalibrationRequest& request) {
  return state_->call(&v1::CalibrationService::Stub::StartCalibration, request);
}

v1::PushReferencePosesResponse Client::push_reference_poses(
    const std::vector<v1::PushReferencePosesRequest>& pieces) {
  grpc::ClientContext context;
  state_->keeper->add_to(context);
  v1::PushReferencePosesResponse response;
  const auto writer =
      state_->stubs.get<v1::CalibrationService::Stub>().PushReferencePoses(&context, &response);
  for (const v1::PushReferencePosesRequest& piece : pieces) {
    if (!writer->Write(piece)) break;  // refused: the status says why
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  if (!status.ok()) {
    throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                            status.error_details(), state_->options.address);
  }
  return response;
}

v1::CalibrationProgress Client::finish_calibration() {
  return state_->call(&v1::CalibrationService::Stub::FinishCalibration, v1::FinishCalibrationRequest(),
                      kFitting);
}

v1::CalibrationProgress Client::cancel_calibration() {
  return state_->call(&v1::CalibrationService::Stub::CancelCalibration, v1::CancelCalibrationRequest(),
                      kFitting);
}

CalibrationStream Client::watch_calibration(const std::string& calibration) {
  v1::WatchCalibrationRequest request;
  request.set_calibration(calibration);
  return CalibrationStream(state_->stream(&v1::CalibrationService::Stub::AsyncWatchCalibration, request));
}

v1::ListCalibrationsResponse Client::calibrations() {
  return state_->call(&v1::CalibrationService::Stub::ListCalibrations, v1::ListCalibrationsRequest());
}

v1::Calibration Client::calibration(const std::string& hash) {
  v1::GetCalibrationRequest request;
  request.set_hash(hash);
  return state_->call(&v1::CalibrationService::Stub::GetCalibration, request);
}

std::string Client::adopt_calibration(const std::string& hash) {
  v1::AdoptCalibrationRequest request;
  request.set_hash(hash);
  return state_->call(&v1::CalibrationService::Stub::AdoptCalibration, request).hash();
}

void Client::delete_calibration(const std::string& hash) {
  v1::DeleteCalibrationRequest request;
  request.set_hash(hash);
  state_->call(&v1::CalibrationService::Stub::DeleteCalibration, request);
}

}  // namespace hapticd::client
