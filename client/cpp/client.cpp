#include "client/cpp/client.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "client/cpp/certificates.h"
#include "client/cpp/client_state.h"
#include "client/cpp/recording_upload_state.h"
#include "client/cpp/tls/client_context.h"

namespace hapticd::client {
namespace {

constexpr std::chrono::seconds kLastFit{30};
/// What hardware may take to answer, beyond the timeout.
constexpr std::chrono::seconds kHardwareAnswers{10};
constexpr std::chrono::seconds kSlowDrive{30};

template <class Request>
void set_source(Request& request, const SceneSource& source) {
  if (source.toml.empty()) {
    request.set_name(source.name);
  } else {
    request.set_toml(source.toml);
  }
  request.set_object_model(source.object_model);
}

}  // namespace

Client::Client(ClientOptions options) : state_(std::make_unique<State>(std::move(options))) {
  const ClientOptions& used = state_->options;
  if (!needs_certificates(used.address)) return;
  const CertificateFiles files = find_certificates(used.address, used.certificates);
  client_context(files.certificate, files.key, files.authority);  // so that a stop has not to read them
}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

const std::string& Client::address() const noexcept {
  return state_->options.address;
}

v1::RigInfo Client::rig_info() {
  return state_->call(&v1::RigService::Stub::GetRigInfo, v1::GetRigInfoRequest());
}

v1::RigState Client::rig_state(Histograms histograms) {
  v1::GetRigStateRequest request;
  request.set_without_histograms(histograms == Histograms::kWithout);
  return state_->call(&v1::RigService::Stub::GetRigState, request);
}

v1::Diagnosis Client::diagnose(bool probe) {
  v1::DiagnoseRequest request;
  request.set_probe(probe);
  return state_->call(&v1::RigService::Stub::Diagnose, request, kHardwareAnswers);
}

v1::SensorBias Client::bias_force_sensor(bool tool_is_free) {
  v1::BiasForceSensorRequest request;
  request.set_tool_is_free(tool_is_free);
  return state_->call(&v1::RigService::Stub::BiasForceSensor, request, kHardwareAnswers).bias();
}

void Client::home_device() {
  state_->call(&v1::RigService::Stub::HomeDevice, v1::HomeDeviceRequest(), kHardwareAnswers);
}

v1::ListScenesResponse Client::scenes() {
  return state_->call(&v1::SceneService::Stub::ListScenes, v1::ListScenesRequest());
}

v1::LoadSceneResponse Client::load_scene(const SceneSource& source) {
  v1::LoadSceneRequest request;
  set_source(request, source);
  return state_->call(&v1::SceneService::Stub::LoadScene, request, kHardwareAnswers);
}

v1::UnloadSceneResponse Client::unload_scene() {
  return state_->call(&v1::SceneService::Stub::UnloadScene, v1::UnloadSceneRequest());
}

v1::SceneOutline Client::explain_scene(const SceneSource& source) {
  v1::ExplainSceneRequest request;
  set_source(request, source);
  return state_->call(&v1::SceneService::Stub::ExplainScene, request);
}

v1::ListModelsResponse Client::models() {
  return state_->call(&v1::ModelService::Stub::ListModels, v1::ListModelsRequest());
}

v1::GetModelResponse Client::model(const std::string& name) {
  v1::GetModelRequest request;
  request.set_name(name);
  return state_->call(&v1::ModelService::Stub::GetModel, request);
}

v1::ListStoredModelsResponse Client::stored_models(const v1::ListStoredModelsRequest& request) {
  return state_->call(&v1::ModelService::Stub::ListStoredModels, request);
}

v1::StoredModel Client::stored_model(const std::string& hash) {
  v1::GetStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(&v1::ModelService::Stub::GetStoredModel, request);
}

v1::DiffStoredModelsResponse Client::diff_stored_models(const std::string& hash_a,
                                                        const std::string& hash_b) {
  v1::DiffStoredModelsRequest request;
  request.set_hash_a(hash_a);
  request.set_hash_b(hash_b);
  return state_->call(&v1::ModelService::Stub::DiffStoredModels, request);
}

v1::StoredModel Client::tag_stored_model(const std::string& hash, const std::string& tag) {
  v1::TagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag(tag);
  return state_->call(&v1::ModelService::Stub::TagStoredModel, request);
}

v1::StoredModel Client::untag_stored_model(const std::string& hash, const std::string& tag) {
  v1::UntagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag(tag);
  return state_->call(&v1::ModelService::Stub::UntagStoredModel, request);
}

v1::DeleteStoredModelResponse Client::delete_stored_model(const std::string& hash) {
  v1::DeleteStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(&v1::ModelService::Stub::DeleteStoredModel, request);
}

v1::ExportStoredModelResponse Client::export_stored_model(const std::string& hash) {
  v1::ExportStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(&v1::ModelService::Stub::ExportStoredModel, request);
}

v1::StoredModel Client::import_stored_model(const std::string& json) {
  v1::ImportStoredModelRequest request;
  request.set_json(json);
  return state_->call(&v1::ModelService::Stub::ImportStoredModel, request);
}

v1::SetTargetResponse Client::set_target(const v1::SetTargetRequest& request) {
  std::chrono::nanoseconds lead{0};
  if (request.at_time_ns() > 0) {
    const std::chrono::nanoseconds ahead{request.at_time_ns() - rig_state().time_ns()};
    // No daemon takes a target further ahead than a minute: an absurd one is refused at once instead of
    // being waited for.
    lead = std::clamp(ahead, std::chrono::nanoseconds{0}, std::chrono::nanoseconds{std::chrono::minutes(1)});
  }
  return state_->call(&v1::RenderingService::Stub::SetTarget, request, lead);
}

v1::FeasibleRange Client::feasible_range(const v1::GetFeasibleRangeRequest& request) {
  return state_->call(&v1::RenderingService::Stub::GetFeasibleRange, request);
}

v1::SimulationInfo Client::simulation() {
  return state_->call(&v1::SimulationService::Stub::GetSimulation, v1::GetSimulationRequest());
}

void Client::set_hand_program(const v1::HandProgram& program) {
  v1::SetHandProgramRequest request;
  *request.mutable_program() = program;
  state_->call(&v1::SimulationService::Stub::SetHandProgram, request);
}

bool Client::wait_for_hand(std::chrono::milliseconds timeout) {
  constexpr std::chrono::milliseconds kPollInterval{50};
  const auto until = std::chrono::steady_clock::now() + timeout;
  while (!simulation().hand_is_done()) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(kPollInterval);
  }
  return true;
}

v1::SimulationInfo Client::set_object(const std::string& name) {
  v1::SetObjectRequest request;
  request.set_name(name);
  return state_->call(&v1::SimulationService::Stub::SetObject, request).simulation();
}

v1::StartIdentificationResponse Client::start_identification(const v1::StartIdentificationRequest& request) {
  return state_->call(&v1::IdentificationService::Stub::StartIdentification, request);
}

v1::IdentificationProgress Client::cancel_identification(const std::string& identification) {
  v1::CancelIdentificationRequest request;
  request.set_identification(identification);
  return state_->call(&v1::IdentificationService::Stub::CancelIdentification, request, kLastFit);
}

v1::ListIdentificationsResponse Client::identifications() {
  return state_->call(&v1::IdentificationService::Stub::ListIdentifications,
                      v1::ListIdentificationsRequest());
}

IdentificationStream Client::watch_identification(const std::string& identification) {
  v1::WatchIdentificationRequest request;
  request.set_identification(identification);
  return IdentificationStream(
      state_->stream(&v1::IdentificationService::Stub::AsyncWatchIdentification, request));
}

RecordingUpload Client::upload_recording(const v1::RecordingDescription& description) {
  return RecordingUpload(
      std::make_unique<RecordingUpload::State>(state_->channel, description, state_->options.address));
}

v1::Turntable Client::turntable() {
  return state_->call(&v1::TurntableService::Stub::GetTurntable, v1::GetTurntableRequest());
}

TurntableStream Client::home_turntable() {
  state_->prepare_command();
  return TurntableStream(state_->stream(&v1::TurntableService::Stub::AsyncHome, v1::HomeRequest()));
}

TurntableStream Client::move_turntable(const v1::MoveToRequest& request) {
  state_->prepare_command();
  return TurntableStream(state_->stream(&v1::TurntableService::Stub::AsyncMoveTo, request));
}

v1::TurntableStatus Client::stop_turntable() {
  return state_->call(&v1::TurntableService::Stub::StopTurntable, v1::StopTurntableRequest());
}

v1::TurntableStatus Client::clear_turntable() {
  return state_->call(&v1::TurntableService::Stub::ClearAlarm, v1::ClearAlarmRequest(), kSlowDrive);
}

v1::TurntableStatus Client::engage_turntable() {
  return state_->call(&v1::TurntableService::Stub::Engage, v1::EngageRequest(), kSlowDrive);
}

v1::TurntableStatus Client::disengage_turntable() {
  return state_->call(&v1::TurntableService::Stub::Disengage, v1::DisengageRequest(), kSlowDrive);
}

TelemetryStream Client::subscribe(const v1::SubscribeRequest& request) {
  return {
      MessageStream<v1::TelemetryBatch>(state_->stream(&v1::TelemetryService::Stub::AsyncSubscribe, request)),
      request.decimation()};
}

GuideStream Client::move_tool(const v1::MoveToolRequest& request) {
  state_->prepare_command();
  return GuideStream(state_->stream(&v1::GuideService::Stub::AsyncMoveTool, request));
}

v1::BeginPresentationResponse Client::begin_presentation() {
  return state_->call(&v1::PresentationService::Stub::BeginPresentation, v1::BeginPresentationRequest());
}

v1::PresentationSummary Client::end_presentation() {
  return state_->call(&v1::PresentationService::Stub::EndPresentation, v1::EndPresentationRequest());
}

void Client::report_experiment(const v1::ExperimentProgress& progress) {
  state_->call(&v1::ExperimentService::Stub::ReportExperiment, progress);
}

v1::ExperimentState Client::experiment() {
  return state_->call(&v1::ExperimentService::Stub::GetExperiment, v1::GetExperimentRequest());
}

}  // namespace hapticd::client
