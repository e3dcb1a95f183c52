#include "server/grpc_server.h"

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "server/crash_guard.h"
#include "server/log.h"
#include "server/memory_watch.h"
#include "server/scene_host.h"
#include "server/services/identification_service.h"
#include "server/services/model_service.h"
#include "server/services/rendering_service.h"
#include "server/services/rig_service.h"
#include "server/services/safety_service.h"
#include "server/services/scene_service.h"
#include "server/services/simulation_service.h"
#include "server/services/standing_poller.h"
#include "server/services/telemetry_service.h"
#include "server/services/turntable_service.h"

namespace hapticd::server {

namespace {

constexpr int kLargestRequest = 1 << 20;
/// More than all targets that may wait for their time, with room for the calls of everyone else.
constexpr int kMostThreads = 64;
/// Calls under way on one connection; more wait at the client. A call costs some 25 kB here before anything
/// is done for it.
constexpr int kMaxStreams = 100;
/// Of the buffers of all calls and connections together; what calls take that were given up at once is the
/// matter of the MemoryWatch.
constexpr std::size_t kMaxNetworkMemory = std::size_t{256} << 20U;

/// gRPC tells only that it could not listen. Why, the system tells whoever tries; empty where it lets one.
std::string why_not_bound(const ListenAddress& listen) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int failure =
          getaddrinfo(listen.host.c_str(), std::to_string(listen.port).c_str(), &hints, &found);
      failure != 0) {
    return gai_strerror(failure);
  }
  std::string reason;
  const int probe = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (probe >= 0) {
    const int on = 1;
    setsockopt(probe, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(probe, found->ai_addr, found->ai_addrlen) != 0 || ::listen(probe, 1) != 0)
      reason = std::strerror(errno);
    close(probe);
  }
  freeaddrinfo(found);
  return reason;
}

hal::Error cannot_listen(const ListenAddress& listen, const std::string& reason) {
  return {"cannot listen", listen.text(), reason.empty() ? "unknown" : reason, "",
          "stop whoever listens there (another hapticd?), or choose another port with --listen"};
}

/// Gives every thread that serves calls a stack for crash handlers, once, before the call is read: parsers of
/// what clients send are where a stack could be used up. It intercepts nothing.
class CrashStackForCallers final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo*) override {
    use_crash_stack();
    return nullptr;
  }
};

void discard(gpr_log_func_args*) {}

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
  int port = 0;
  std::optional<MemoryWatch> memory;
  std::optional<StandingPoller> poller;  // ends after the server
  std::unique_ptr<grpc::Server> server;  // last: ends before the services it calls
};

std::optional<hal::Error> GrpcServer::check(const ListenAddress& listen) {
  const std::string reason = why_not_bound(listen);
  if (reason.empty()) return std::nullopt;
  return cannot_listen(listen, reason);
}

GrpcServer::GrpcServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

GrpcServer::~GrpcServer() {
  if (state_->server) shutdown(std::chrono::milliseconds::zero());
}

hal::Result<std::unique_ptr<GrpcServer>> GrpcServer::start(const Parts& parts, const ListenAddress& listen,
                                                           const std::string& unix_socket) {
  auto state = std::make_unique<State>(parts);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  grpc::ServerBuilder builder;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // or a second daemon would share the port unseen
  builder.SetMaxReceiveMessageSize(kLargestRequest);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreams);
  grpc::ResourceQuota quota("hapticd");
  quota.SetMaxThreads(kMostThreads);
  quota.Resize(kMaxNetworkMemory);
  builder.SetResourceQuota(quota);
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CrashStackForCallers>());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  builder.AddListeningPort(listen.text(), grpc::InsecureServerCredentials(), &state->port);
  if (!unix_socket.empty())
    builder.AddListeningPort("unix:" + unix_socket, grpc::InsecureServerCredentials());
  for (grpc::Service* service : std::initializer_list<grpc::Service*>{
           &state->rig, &state->scene, &state->model, &state->rendering, &state->telemetry,
           &state->simulation, &state->safety, &state->identification, &state->turntable}) {
    builder.RegisterService(service);
  }
  state->poller.emplace(builder);
  gpr_set_log_function(discard);  // a port that is taken is told once, and by us
  state->server = builder.BuildAndStart();
  gpr_set_log_function(pass_on);
  if (state->server == nullptr || state->port == 0) {
    if (state->port != 0) {
      return hal::Error{"cannot listen on the unix socket", unix_socket, "", "",
                        "check that its folder exists and may be written to"};
    }
    return cannot_listen(listen, why_not_bound(listen));
  }
  state->poller->start();
  std::unique_ptr<GrpcServer> server(new GrpcServer(std::move(state)));
  server->set_serving(false);
  return server;
}

std::uint16_t GrpcServer::port() const {
  return static_cast<std::uint16_t>(state_->port);
}

void GrpcServer::set_serving(bool serving) {
  // Only now is all the memory there that the daemon takes for itself.
  if (serving && !state_->memory) state_->memory.emplace(port());
  if (auto* health = state_->server->GetHealthCheckService()) health->SetServingStatus(serving);
}

void GrpcServer::shutdown(std::chrono::milliseconds patience) {
  state_->server->Shutdown(std::chrono::system_clock::now() + patience);
  state_->server->Wait();
}

}  // namespace hapticd::server
