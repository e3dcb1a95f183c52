#include "server/grpc/grpc_server.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <utility>
#include <vector>

#include "server/grpc/calls/standing_poller.h"
#include "server/grpc/calls/unreadable_request.h"
#include "server/grpc/connection_listener.h"
#include "server/grpc/services/identification_service.h"
#include "server/grpc/services/model_service.h"
#include "server/grpc/services/rendering_service.h"
#include "server/grpc/services/rig_service.h"
#include "server/grpc/services/safety_service.h"
#include "server/grpc/services/scene_service.h"
#include "server/grpc/services/simulation_service.h"
#include "server/grpc/services/telemetry_service.h"
#include "server/grpc/services/turntable_service.h"
#include "server/process/crash_guard.h"
#include "server/process/log.h"
#include "server/process/memory_watch.h"
#include "server/scene/scene_host.h"

namespace hapticd::server {

namespace {

constexpr int kMaxRequest = 1 << 20;
/// More than the targets that may wait for their time, plus the calls of other clients.
constexpr int kMaxThreads = 64;
/// Calls at once on one connection; more wait at the client. A call takes some 25 kB here before it is
/// handled.
constexpr int kMaxStreams = 100;
/// Of the buffers of all calls and connections together. The MemoryWatch limits the memory of calls that were
/// cancelled at once.
constexpr std::size_t kMaxNetworkMemory = std::size_t{256} << 20U;
/// Bytes read of a connection at once. gRPC makes of all it has read what it takes for a call, 30 kB for 40
/// bytes, before the MemoryWatch can end the connection; of the 4 MB it reads else that would be gigabytes.
constexpr int kMaxRead = 16'384;
/// A connection that does not start HTTP/2 within this time is closed.
constexpr int kMaxHandshakeMs = 10'000;
/// A connection without a call for so long is closed in an orderly way; the next call connects again.
constexpr int kMaxIdleMs = 600'000;

/// Gives every thread that serves calls a stack for crash handlers, once, before the call is read: parsers of
/// requests could use up a stack. Intercepts calls only to find requests that cannot be read.
class CrashStackForCallers final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  /// gRPC owns what it gets.
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override {
    use_crash_stack();
    return watch_for_unreadable_request(*call).release();
  }
};

void pass_on(gpr_log_func_args* line) {
  if (line->severity == GPR_LOG_SEVERITY_ERROR) log_warning(std::string("gRPC: ") + line->message);
}

}  // namespace

struct GrpcServer::State {
  explicit State(const Parts& parts)
      : rig(parts.session, parts.scenes, parts.hub, parts.biases, parts.turntable),
        scene(parts.scenes),
        model(parts.scenes),
        rendering(parts.targets, parts.hub),
        telemetry(parts.hub),
        simulation(parts.session, parts.scenes),
        identification(parts.identifications),
        turntable(parts.turntable),
        safety(parts.latch) {}

  RigService rig;
  SceneService scene;
  ModelService model;
  RenderingService rendering;
  TelemetryService telemetry;
  SimulationService simulation;
  IdentificationService identification;
  TurntableService turntable;
  SafetyService safety;
  std::optional<MemoryWatch> memory;
  std::optional<StandingPoller> poller;  // ends after the server
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> server;          // ends before the services it calls
  std::unique_ptr<ConnectionListener> listener;  // last: hands connections to the server
};

std::optional<hal::Error> GrpcServer::check(const ListenAddress& listen) {
  const auto bound = ConnectionListener::open(listen);
  return bound ? std::nullopt : std::optional(bound.error());
}

GrpcServer::GrpcServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

GrpcServer::~GrpcServer() {
  if (state_->server) shutdown(std::chrono::milliseconds::zero());
}

hal::Result<std::unique_ptr<GrpcServer>> GrpcServer::start(const Parts& parts, const ListenAddress& listen,
                                                           const std::string& unix_socket) {
  auto listener = ConnectionListener::open(listen, unix_socket);
  if (!listener) return listener.error();
  auto state = std::make_unique<State>(parts);
  state->listener = std::move(*listener);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  grpc::ServerBuilder builder;
  builder.SetMaxReceiveMessageSize(kMaxRequest);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreams);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kMaxHandshakeMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdleMs);
  builder.AddChannelArgument(GRPC_ARG_TCP_READ_CHUNK_SIZE, kMaxRead);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMaxRead);
  grpc::ResourceQuota quota("hapticd");
  quota.SetMaxThreads(kMaxThreads);
  quota.Resize(kMaxNetworkMemory);
  builder.SetResourceQuota(quota);
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CrashStackForCallers>());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  using Connections = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  state->acceptor = builder.experimental().AddExternalConnectionAcceptor(Connections::FROM_FD,
                                                                         grpc::InsecureServerCredentials());
  for (grpc::Service* service : std::initializer_list<grpc::Service*>{
           &state->rig, &state->scene, &state->model, &state->rendering, &state->telemetry,
           &state->simulation, &state->safety, &state->identification, &state->turntable}) {
    builder.RegisterService(service);
  }
  state->poller.emplace(builder);
  gpr_set_log_function(pass_on);
  // protobuf logs each text that is not UTF-8. The client gets the error and must not fill the log.
  google::protobuf::SetLogHandler(nullptr);
  state->server = builder.BuildAndStart();
  if (state->server == nullptr) return hal::Error{"gRPC does not start", listen.text(), "", "", ""};
  state->poller->start();
  state->listener->start([acceptor = state->acceptor.get()](int descriptor) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = descriptor;
    acceptor->HandleNewConnection(&connection);
  });
  std::unique_ptr<GrpcServer> server(new GrpcServer(std::move(state)));
  server->set_serving(false);
  return server;
}

std::uint16_t GrpcServer::port() const {
  return state_->listener->port();
}

void GrpcServer::set_serving(bool serving) {
  // Only now has the daemon all the memory that it needs for itself.
  if (serving && !state_->memory) state_->memory.emplace(port());
  if (auto* health = state_->server->GetHealthCheckService()) health->SetServingStatus(serving);
}

void GrpcServer::shutdown(std::chrono::milliseconds timeout) {
  state_->listener->stop();
  state_->server->Shutdown(std::chrono::system_clock::now() + timeout);
  state_->server->Wait();
}

}  // namespace hapticd::server
