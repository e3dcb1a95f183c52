#include "client/cpp/client.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <utility>

#include "client/cpp/channel.h"
#include "client/cpp/lease_keeper.h"
#include "client/cpp/recording_upload_state.h"
#include "client/cpp/server_stream.h"
#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/model.grpc.pb.h"
#include "hapticd/v1/rendering.grpc.pb.h"
#include "hapticd/v1/rig.grpc.pb.h"
#include "hapticd/v1/safety.grpc.pb.h"
#include "hapticd/v1/scene.grpc.pb.h"
#include "hapticd/v1/simulation.grpc.pb.h"
#include "hapticd/v1/telemetry.grpc.pb.h"
#include "hapticd/v1/turntable.grpc.pb.h"

namespace hapticd::client {
namespace {

/// A call that is answered with a stream of messages; `method` is the stub's Async… of it.
template <class Message, class Stub, class Request, class Method>
std::unique_ptr<ServerStream<Message>> streaming(const std::shared_ptr<Stub>& stub,
                                                 const std::string& address, const LeaseKeeper& keeper,
                                                 const Request& request, Method method) {
  return std::make_unique<ServerStream<Message>>(
      stub, address, [&](Stub& on, grpc::ClientContext* context, grpc::CompletionQueue* queue) {
        keeper.add_to(*context);
        return (on.*method)(context, request, queue, nullptr);
      });
}

constexpr std::chrono::seconds kLastFit{30};
constexpr std::chrono::seconds kLongestNotice{10};
/// What the daemon keeps of a reason. Nothing longer is sent: a request may be too large to arrive.
constexpr std::size_t kMaxStopReason = 256;
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

struct Client::State {
  explicit State(ClientOptions given)
      : options(std::move(given)),
        channel(open_channel(options)),
        rig(v1::RigService::NewStub(channel)),
        scene(v1::SceneService::NewStub(channel)),
        model(v1::ModelService::NewStub(channel)),
        rendering(v1::RenderingService::NewStub(channel)),
        safety(v1::SafetyService::NewStub(channel)),
        simulation(v1::SimulationService::NewStub(channel)),
        identification(v1::IdentificationService::NewStub(channel)),
        turntable(v1::TurntableService::NewStub(channel)),
        access(v1::AccessService::NewStub(channel)),
        keeper(std::make_unique<LeaseKeeper>(channel, options.lease_token)) {}

  /// One unary call: `method` of `stub` with a deadline; its answer, or an Error thrown.
  template <class Stub, class Request, class Response>
  Response call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request, std::chrono::nanoseconds extra_time = {}) {
    try {
      return call_once(stub, method, request, extra_time);
    } catch (const Error& error) {
      const bool can_help =
          options.acquires_lease && error.detail().reason() == v1::ERROR_REASON_LEASE_REQUIRED;
      if (!can_help) throw;
    }
    acquire_for_commands();
    return call_once(stub, method, request, extra_time);
  }

  template <class Stub, class Request, class Response>
  Response call_once(Stub& stub,
                     grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                     const Request& request, std::chrono::nanoseconds extra_time) {
    grpc::ClientContext context;
    keeper->add_to(context);
    context.set_deadline(std::chrono::system_clock::now() + options.timeout +
                         std::chrono::duration_cast<std::chrono::milliseconds>(extra_time));
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (!status.ok()) {
      throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                              status.error_details(), options.address);
    }
    return response;
  }

  void acquire_for_commands() {
    v1::AcquireLeaseRequest request;
    request.set_purpose(options.lease_purpose);
    keeper->keep(call_once(keeper->stub(), &v1::LeaseService::Stub::AcquireLease, request, {}));
  }

  /// Before a command that is answered with a stream: its refusal would come too late to do something about
  /// it.
  void prepare_command() {
    if (!options.acquires_lease || !keeper->token().empty()) return;
    const v1::Access mine = call(*access, &v1::AccessService::Stub::GetAccess, v1::GetAccessRequest());
    if (mine.lease_rule() == v1::LEASE_RULE_REQUIRED) acquire_for_commands();
  }

  ClientOptions options;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::RigService::Stub> rig;
  std::unique_ptr<v1::SceneService::Stub> scene;
  std::unique_ptr<v1::ModelService::Stub> model;
  std::unique_ptr<v1::RenderingService::Stub> rendering;
  std::unique_ptr<v1::SafetyService::Stub> safety;
  std::unique_ptr<v1::SimulationService::Stub> simulation;
  std::unique_ptr<v1::IdentificationService::Stub> identification;
  std::unique_ptr<v1::TurntableService::Stub> turntable;
  std::unique_ptr<v1::AccessService::Stub> access;
  std::unique_ptr<LeaseKeeper> keeper;
};

Client::Client(ClientOptions options) : state_(std::make_unique<State>(std::move(options))) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

const std::string& Client::address() const noexcept {
  return state_->options.address;
}

v1::Access Client::access() {
  return state_->call(*state_->access, &v1::AccessService::Stub::GetAccess, v1::GetAccessRequest());
}

v1::LeaseState Client::lease() {
  return state_->call(state_->keeper->stub(), &v1::LeaseService::Stub::GetLease, v1::GetLeaseRequest());
}

v1::LeaseGrant Client::acquire_lease(const v1::AcquireLeaseRequest& request) {
  const auto grant = state_->call(state_->keeper->stub(), &v1::LeaseService::Stub::AcquireLease, request);
  state_->keeper->keep(grant);
  return grant;
}

v1::LeaseGrant Client::take_lease(const v1::TakeLeaseRequest& request) {
  const auto grant =
      state_->call(state_->keeper->stub(), &v1::LeaseService::Stub::TakeLease, request, kLongestNotice);
  state_->keeper->keep(grant);
  return grant;
}

void Client::return_lease() {
  state_->keeper->give_back();
}

LeaseStream Client::watch_lease() {
  return LeaseStream(streaming<v1::LeaseState>(
      std::shared_ptr(v1::LeaseService::NewStub(state_->channel)), state_->options.address, *state_->keeper,
      v1::WatchLeaseRequest(), &v1::LeaseService::Stub::AsyncWatchLease));
}

v1::RigInfo Client::rig_info() {
  return state_->call(*state_->rig, &v1::RigService::Stub::GetRigInfo, v1::GetRigInfoRequest());
}

v1::RigState Client::rig_state(Histograms histograms) {
  v1::GetRigStateRequest request;
  request.set_without_histograms(histograms == Histograms::kWithout);
  return state_->call(*state_->rig, &v1::RigService::Stub::GetRigState, request);
}

v1::Diagnosis Client::diagnose(bool probe) {
  v1::DiagnoseRequest request;
  request.set_probe(probe);
  return state_->call(*state_->rig, &v1::RigService::Stub::Diagnose, request, kHardwareAnswers);
}

v1::SensorBias Client::bias_force_sensor() {
  return state_
      ->call(*state_->rig, &v1::RigService::Stub::BiasForceSensor, v1::BiasForceSensorRequest(),
             kHardwareAnswers)
      .bias();
}

void Client::home_device() {
  state_->call(*state_->rig, &v1::RigService::Stub::HomeDevice, v1::HomeDeviceRequest(), kHardwareAnswers);
}

v1::ListScenesResponse Client::scenes() {
  return state_->call(*state_->scene, &v1::SceneService::Stub::ListScenes, v1::ListScenesRequest());
}

v1::LoadSceneResponse Client::load_scene(const SceneSource& source) {
  v1::LoadSceneRequest request;
  set_source(request, source);
  return state_->call(*state_->scene, &v1::SceneService::Stub::LoadScene, request, kHardwareAnswers);
}

v1::UnloadSceneResponse Client::unload_scene() {
  return state_->call(*state_->scene, &v1::SceneService::Stub::UnloadScene, v1::UnloadSceneRequest());
}

v1::SceneOutline Client::explain_scene(const SceneSource& source) {
  v1::ExplainSceneRequest request;
  set_source(request, source);
  return state_->call(*state_->scene, &v1::SceneService::Stub::ExplainScene, request);
}

v1::ListModelsResponse Client::models() {
  return state_->call(*state_->model, &v1::ModelService::Stub::ListModels, v1::ListModelsRequest());
}

v1::GetModelResponse Client::model(const std::string& name) {
  v1::GetModelRequest request;
  request.set_name(name);
  return state_->call(*state_->model, &v1::ModelService::Stub::GetModel, request);
}

v1::ListStoredModelsResponse Client::stored_models(const v1::ListStoredModelsRequest& request) {
  return state_->call(*state_->model, &v1::ModelService::Stub::ListStoredModels, request);
}

v1::StoredModel Client::stored_model(const std::string& hash) {
  v1::GetStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(*state_->model, &v1::ModelService::Stub::GetStoredModel, request);
}

v1::DiffStoredModelsResponse Client::diff_stored_models(const std::string& hash_a,
                                                        const std::string& hash_b) {
  v1::DiffStoredModelsRequest request;
  request.set_hash_a(hash_a);
  request.set_hash_b(hash_b);
  return state_->call(*state_->model, &v1::ModelService::Stub::DiffStoredModels, request);
}

v1::StoredModel Client::tag_stored_model(const std::string& hash, const std::string& tag) {
  v1::TagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag(tag);
  return state_->call(*state_->model, &v1::ModelService::Stub::TagStoredModel, request);
}

v1::StoredModel Client::untag_stored_model(const std::string& hash, const std::string& tag) {
  v1::UntagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag(tag);
  return state_->call(*state_->model, &v1::ModelService::Stub::UntagStoredModel, request);
}

v1::DeleteStoredModelResponse Client::delete_stored_model(const std::string& hash) {
  v1::DeleteStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(*state_->model, &v1::ModelService::Stub::DeleteStoredModel, request);
}

v1::ExportStoredModelResponse Client::export_stored_model(const std::string& hash) {
  v1::ExportStoredModelRequest request;
  request.set_hash(hash);
  return state_->call(*state_->model, &v1::ModelService::Stub::ExportStoredModel, request);
}

v1::StoredModel Client::import_stored_model(const std::string& json) {
  v1::ImportStoredModelRequest request;
  request.set_json(json);
  return state_->call(*state_->model, &v1::ModelService::Stub::ImportStoredModel, request);
}

v1::SetTargetResponse Client::set_target(const v1::SetTargetRequest& request) {
  std::chrono::nanoseconds lead{0};
  if (request.at_time_ns() > 0) {
    const std::chrono::nanoseconds ahead{request.at_time_ns() - rig_state().time_ns()};
    // No daemon takes a target further ahead than a minute: an absurd one is refused at once instead of
    // being waited for.
    lead = std::clamp(ahead, std::chrono::nanoseconds{0}, std::chrono::nanoseconds{std::chrono::minutes(1)});
  }
  return state_->call(*state_->rendering, &v1::RenderingService::Stub::SetTarget, request, lead);
}

v1::FeasibleRange Client::feasible_range(const v1::GetFeasibleRangeRequest& request) {
  return state_->call(*state_->rendering, &v1::RenderingService::Stub::GetFeasibleRange, request);
}

v1::StopResponse Client::stop(const std::string& reason) {
  v1::StopRequest request;
  request.set_reason(reason.substr(0, kMaxStopReason));
  return state_->call(*state_->safety, &v1::SafetyService::Stub::Stop, request);
}

v1::ClearResponse Client::clear() {
  return state_->call(*state_->safety, &v1::SafetyService::Stub::Clear, v1::ClearRequest());
}

v1::ListFaultsResponse Client::faults() {
  return state_->call(*state_->safety, &v1::SafetyService::Stub::ListFaults, v1::ListFaultsRequest());
}

v1::SimulationInfo Client::simulation() {
  return state_->call(*state_->simulation, &v1::SimulationService::Stub::GetSimulation,
                      v1::GetSimulationRequest());
}

void Client::set_hand_program(const v1::HandProgram& program) {
  v1::SetHandProgramRequest request;
  *request.mutable_program() = program;
  state_->call(*state_->simulation, &v1::SimulationService::Stub::SetHandProgram, request);
}

v1::SimulationInfo Client::set_object(const std::string& name) {
  v1::SetObjectRequest request;
  request.set_name(name);
  return state_->call(*state_->simulation, &v1::SimulationService::Stub::SetObject, request).simulation();
}

v1::StartIdentificationResponse Client::start_identification(const v1::StartIdentificationRequest& request) {
  return state_->call(*state_->identification, &v1::IdentificationService::Stub::StartIdentification,
                      request);
}

v1::IdentificationProgress Client::cancel_identification(const std::string& identification) {
  v1::CancelIdentificationRequest request;
  request.set_identification(identification);
  return state_->call(*state_->identification, &v1::IdentificationService::Stub::CancelIdentification,
                      request, kLastFit);
}

v1::ListIdentificationsResponse Client::identifications() {
  return state_->call(*state_->identification, &v1::IdentificationService::Stub::ListIdentifications,
                      v1::ListIdentificationsRequest());
}

IdentificationStream Client::watch_identification(const std::string& identification) {
  v1::WatchIdentificationRequest request;
  request.set_identification(identification);
  return IdentificationStream(streaming<v1::IdentificationProgress>(
      std::shared_ptr(v1::IdentificationService::NewStub(state_->channel)), state_->options.address,
      *state_->keeper, request, &v1::IdentificationService::Stub::AsyncWatchIdentification));
}

RecordingUpload Client::upload_recording(const v1::RecordingDescription& description) {
  return RecordingUpload(
      std::make_unique<RecordingUpload::State>(state_->channel, description, state_->options.address));
}

v1::Turntable Client::turntable() {
  return state_->call(*state_->turntable, &v1::TurntableService::Stub::GetTurntable,
                      v1::GetTurntableRequest());
}

TurntableStream Client::home_turntable() {
  state_->prepare_command();
  return TurntableStream(streaming<v1::TurntableStatus>(
      std::shared_ptr(v1::TurntableService::NewStub(state_->channel)), state_->options.address,
      *state_->keeper, v1::HomeRequest(), &v1::TurntableService::Stub::AsyncHome));
}

TurntableStream Client::move_turntable(const v1::MoveToRequest& request) {
  state_->prepare_command();
  return TurntableStream(streaming<v1::TurntableStatus>(
      std::shared_ptr(v1::TurntableService::NewStub(state_->channel)), state_->options.address,
      *state_->keeper, request, &v1::TurntableService::Stub::AsyncMoveTo));
}

v1::TurntableStatus Client::stop_turntable() {
  return state_->call(*state_->turntable, &v1::TurntableService::Stub::StopTurntable,
                      v1::StopTurntableRequest());
}

v1::TurntableStatus Client::clear_turntable() {
  return state_->call(*state_->turntable, &v1::TurntableService::Stub::ClearAlarm, v1::ClearAlarmRequest(),
                      kSlowDrive);
}

v1::TurntableStatus Client::engage_turntable() {
  return state_->call(*state_->turntable, &v1::TurntableService::Stub::Engage, v1::EngageRequest(),
                      kSlowDrive);
}

v1::TurntableStatus Client::disengage_turntable() {
  return state_->call(*state_->turntable, &v1::TurntableService::Stub::Disengage, v1::DisengageRequest(),
                      kSlowDrive);
}

TelemetryStream Client::subscribe(const v1::SubscribeRequest& request) {
  return {MessageStream<v1::TelemetryBatch>(streaming<v1::TelemetryBatch>(
              std::shared_ptr(v1::TelemetryService::NewStub(state_->channel)), state_->options.address,
              *state_->keeper, request, &v1::TelemetryService::Stub::AsyncSubscribe)),
          request.decimation()};
}

}  // namespace hapticd::client
