#include "server/grpc/grpc_server.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "server/access/call_quota.h"
#include "server/access/certificate.h"
#include "server/connection/connection_listener.h"
#include "server/connection/connection_relay.h"
#include "server/connection/connection_table.h"
#include "server/connection/local_clients.h"
#include "server/grpc/calibration/calibration_service.h"
#include "server/grpc/calls/standing_poller.h"
#include "server/grpc/calls/unreadable_request.h"
#include "server/grpc/experiment/experiment_service.h"
#include "server/grpc/experiment/guide_service.h"
#include "server/grpc/experiment/presentation_service.h"
#include "server/grpc/gate/access_gate.h"
#include "server/grpc/gate/gated_callback.h"
#include "server/grpc/gate/gated_service.h"
#include "server/grpc/gate/thread_places.h"
#include "server/grpc/pose/pose_service.h"
#include "server/grpc/recording/event_service.h"
#include "server/grpc/recording/recording_service.h"
#include "server/grpc/services/access_service.h"
#include "server/grpc/services/clock_service.h"
#include "server/grpc/services/identification_service.h"
#include "server/grpc/services/lease_service.h"
#include "server/grpc/services/model_service.h"
#include "server/grpc/services/rendering_service.h"
#include "server/grpc/services/rig_service.h"
#include "server/grpc/services/safety_service.h"
#include "server/grpc/services/scene_service.h"
#include "server/grpc/services/simulation_service.h"
#include "server/grpc/services/telemetry_service.h"
#include "server/grpc/services/turntable_service.h"
#include "server/grpc/services/watchdog_service.h"
#include "server/process/crash_guard.h"
#include "server/process/log.h"
#include "server/scene/scene_host.h"
#include "server/session/safety_latch.h"

namespace hapticd::server {

namespace {

constexpr int kMaxRequest = 1 << 20;
/// Calls at once on one connection; more wait at the client. A call takes some 25 kB here before it is
/// handled.
constexpr int kMaxStreams = 100;
/// Memory for the buffers of all calls and connections together.
constexpr std::size_t kMaxNetworkMemory = std::size_t{256} << 20U;
/// Bytes read from a connection at once; a header that gRPC takes comes whole. For more than 12 kB gRPC reads
/// into blocks of 64 kB, and keeps a block for each piece of a request in it; for fewer, of 8 kB.
constexpr int kMaxRead = 12'000;
/// A connection without a call for so long is closed in an orderly way; the next call connects again.
constexpr int kMaxIdleMs = 600'000;
/// A client may ask so often whether the daemon is still there, with a call under way or without one. gRPC's
/// own bound is five minutes: it would close the connections of clients that notice a dead network in time.
constexpr int kMinPingIntervalMs = 5'000;

/// Gives every thread that serves calls a stack for crash handlers, once, before the call is read: parsers of
/// requests could use up a stack. Intercepts calls only to find requests that cannot be read, and to count
/// those of reflection.
class CallInterceptors final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  CallInterceptors(const ConnectionTable& connections, ThreadPlaces& threads)
      : connections_(connections), threads_(threads) {}

  /// gRPC owns what it gets.
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override {
    use_crash_stack();
    if (auto watch = watch_for_unreadable_request(*call)) return watch.release();
    return place_of_reflection(*call, connections_, threads_.reflections).release();
  }

 private:
  const ConnectionTable& connections_;
  ThreadPlaces& threads_;
};

/// Passes a line of gRPC on, at most one a second: clients must not fill the log, e.g. with handshakes that
/// fail.
void pass_on(gpr_log_func_args* line) {
  if (line->severity != GPR_LOG_SEVERITY_ERROR) return;
  static std::atomic<std::int64_t> next_ns{0};
  static std::atomic<std::uint64_t> unwritten{0};
  const std::int64_t now_ns =
      std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  std::int64_t due_ns = next_ns.load();
  if (now_ns < due_ns || !next_ns.compare_exchange_strong(due_ns, now_ns + 1'000'000'000)) {
    ++unwritten;
    return;
  }
  const std::uint64_t left_out = unwritten.exchange(0);
  log_warning(std::string("gRPC: ") + line->message +
              (left_out > 0 ? fmt::format(" (and {} more lines)", left_out) : std::string()));
}

}  // namespace

struct GrpcServer::State {
  State(const Parts& parts, const std::string& certificates, const std::string& state_folder,
        const std::string& recording_folder)
      : rig(parts.session, parts.scenes, parts.hub, parts.biases, parts.turntable, parts.watchdog,
            parts.recorder, parts.flight, certificates, state_folder),
        scene(parts.scenes),
        model(parts.scenes),
        rendering(parts.targets, parts.hub),
        telemetry(parts.hub),
        simulation(parts.session, parts.scenes),
        identification(parts.identifications),
        calibration(parts.calibrations),
        turntable(parts.turntable),
        guide(parts.guide),
        presentation(parts.session),
        experiment(parts.leases),
        safety(parts.latch),
        access(parts.policy, parts.consoles),
        lease(parts.leases),
        watchdog(parts.watchdog),
        clock(parts.session),
        recording(parts.recorder, parts.flight, recording_folder),
        pose(parts.poses),
        event(parts.events),
        quota(static_cast<int>(parts.policy.config().max_calls), parts.policy.config().max_calls_per_s) {}

  /// Adds all services of the contract, behind the gate.
  void add_services(SafetyLatch& latch);
  void start_relays(std::unique_ptr<TlsServer> tls, const RolePolicy& policy);

  RigService rig;
  SceneService scene;
  ModelService model;
  RenderingService rendering;
  TelemetryService telemetry;
  SimulationService simulation;
  IdentificationService identification;
  CalibrationService calibration;
  TurntableService turntable;
  GuideService guide;
  PresentationService presentation;
  ExperimentService experiment;
  SafetyService safety;
  AccessService access;
  LeaseService lease;
  WatchdogService watchdog;
  ClockService clock;
  RecordingService recording;
  PoseService pose;
  EventService event;
  CallQuota quota;
  ConnectionTable connections;
  ThreadPlaces threads;
  std::optional<LocalClients> local_clients;  ///< of the listener's thread
  std::optional<AccessGate> gate;
  std::vector<std::unique_ptr<GatedService>> gated;
  std::optional<StandingPoller> poller;  // ends after the server
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> server;        // ends before the services it calls
  std::unique_ptr<ConnectionRelay> relay;      // hands connections to the server
  std::unique_ptr<ConnectionRelay> tls_relay;  // null: there are no certificates
  std::unique_ptr<ConnectionListener> listener;
};

namespace {

/// Finds the daemon's own user, and the one of the configuration. That one may be made while the daemon runs,
/// by the package of the console: it is looked up until it is there.
std::function<bool(unsigned)> console_users(const std::string& name) {
  using Clock = std::chrono::steady_clock;
  return [own = geteuid(), name, found = std::optional<unsigned>(),
          look_at = Clock::time_point{}](unsigned user) mutable {
    if (user == own) return true;
    if (!found && Clock::now() >= look_at) {
      found = user_id(name);
      look_at = Clock::now() + std::chrono::seconds(1);
    }
    return found == user;
  };
}

ConnectionListener::Endpoints endpoints_of(const DaemonConfig& config) {
  return {config.listen, config.unix_socket, config.access.unix_socket_group, config.listen_tls,
          console_users(config.console.user)};
}

}  // namespace

// Adds the services; none is registered otherwise than behind the gate.
void GrpcServer::State::add_services(SafetyLatch& latch) {
  using Context = grpc::CallbackServerContext;
  using Bytes = grpc::ByteBuffer;
  const auto add = [this](const char* name, grpc::Service& inner, auto... callback) {
    std::vector<GatedCallback> callbacks;
    (callbacks.push_back(std::move(callback)), ...);
    const auto* contract = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
        std::string("hapticd.v1.") + name);
    gated.push_back(std::make_unique<GatedService>(*contract, inner, *gate, threads, std::move(callbacks)));
  };
  add("RigService", rig);
  add("SceneService", scene);
  add("ModelService", model);
  add("RenderingService", rendering);
  add("SimulationService", simulation);
  add("IdentificationService", identification);
  add("CalibrationService", calibration);
  add("TurntableService", turntable,
      gated_unary<v1::StopTurntableRequest, v1::TurntableStatus>(
          *gate, "TurntableService", "StopTurntable",
          [this](auto*... call) { return turntable.StopTurntable(call...); }));
  add("GuideService", guide);
  add("PresentationService", presentation);
  add("ExperimentService", experiment);
  add("AccessService", access);
  add("RecordingService", recording);
  add("EventService", event);
  add("SafetyService", safety,
      gated_at_headers(
          *gate, "SafetyService", "Stop",
          [this](const Context& context, const Bytes* request, Bytes& response) {
            return safety.stop(context, request, response);
          },
          // Before anything that could wait: no lock, no lease, no quota.
          [&latch](const Context& context) {
            if (!ConnectionTable::is_denied(context.peer())) latch.stop();
          }),
      gated_unary<v1::ClearRequest, v1::ClearResponse>(
          *gate, "SafetyService", "Clear", [this](auto*... call) { return safety.Clear(call...); }));
  add("TelemetryService", telemetry,
      gated_stream(*gate, "TelemetryService", "Subscribe",
                   [this](auto*... call) { return telemetry.Subscribe(call...); }));
  add("PoseService", pose, gated_stream(*gate, "PoseService", "Subscribe", [this](auto*... call) {
        return pose.Subscribe(call...);
      }));
  add("LeaseService", lease,
      gated_unary<v1::RenewLeaseRequest, v1::Lease>(
          *gate, "LeaseService", "RenewLease", [this](auto*... call) { return lease.RenewLease(call...); }));
  add("WatchdogService", watchdog,
      gated_unary<v1::CheckInRequest, v1::CheckInResponse>(
          *gate, "WatchdogService", "CheckIn", [this](auto*... call) { return watchdog.CheckIn(call...); }));
  add("ClockService", clock,
      gated_unary<v1::ExchangeRequest, v1::ExchangeResponse>(
          *gate, "ClockService", "Exchange", [this](auto*... call) { return clock.Exchange(call...); }));
}

void GrpcServer::State::start_relays(std::unique_ptr<TlsServer> tls, const RolePolicy& policy) {
  const auto serve = [this](int descriptor) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = descriptor;
    acceptor->HandleNewConnection(&connection);
  };
  AccountLimits limits;
  limits.max_calls = std::max(limits.max_calls, 2 * static_cast<int>(policy.config().max_calls));
  const std::size_t max_connections = listener->max_connections() / (tls ? 2 : 1);
  relay = std::make_unique<ConnectionRelay>(
      ConnectionRelay::Parts{policy, connections, serve, nullptr, limits, max_connections, "hapticd-relay"});
  if (!tls) return;
  tls_relay = std::make_unique<ConnectionRelay>(ConnectionRelay::Parts{
      policy, connections, serve, std::move(tls), limits, max_connections, "hapticd-tls"});
}

std::optional<hal::Error> GrpcServer::check(const DaemonConfig& config) {
  if (config.listen_tls) {
    if (auto error = check_certificate_files(CertificateFiles::in(config.certificates))) return error;
  }
  ConnectionListener::Endpoints endpoints = endpoints_of(config);
  endpoints.unix_socket.clear();  // its lock shows whether it is free
  const auto bound = ConnectionListener::open(endpoints);
  return bound ? std::nullopt : std::optional(bound.error());
}

GrpcServer::GrpcServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

GrpcServer::~GrpcServer() {
  if (state_->server) shutdown(std::chrono::milliseconds::zero());
}

hal::Result<std::unique_ptr<GrpcServer>> GrpcServer::start(const Parts& parts, const DaemonConfig& config) {
  auto listener = ConnectionListener::open(endpoints_of(config));
  if (!listener) return listener.error();
  const std::string store = config.model_store.value_or("");
  auto state = std::make_unique<State>(
      parts, config.listen_tls ? config.certificates : std::string(),
      store == ":memory:" ? std::string() : std::filesystem::path(store).parent_path().string(),
      config.recording.folder);
  state->listener = std::move(*listener);
  std::unique_ptr<TlsServer> tls;
  if (config.listen_tls) {
    auto opened = TlsServer::open(config.certificates, "h2");
    if (!opened) return opened.error();
    tls = std::move(*opened);
  }
  state->local_clients.emplace(parts.policy, state->listener->unix_group());
  state->gate.emplace(AccessGate::Parts{parts.policy, state->connections, parts.leases, parts.audit,
                                        state->quota, parts.session, parts.named});
  state->add_services(parts.latch);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  grpc::ServerBuilder builder;
  builder.SetMaxReceiveMessageSize(kMaxRequest);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreams);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdleMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // Else gRPC widens the windows of streams as fast as a client sends, to megabytes.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_TCP_READ_CHUNK_SIZE, kMaxRead);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMaxRead);
  grpc::ResourceQuota quota("hapticd");
  quota.SetMaxThreads(ThreadPlaces::kMaxThreads);
  quota.Resize(kMaxNetworkMemory);
  builder.SetResourceQuota(quota);
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CallInterceptors>(state->connections, state->threads));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  using Connections = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  state->acceptor = builder.experimental().AddExternalConnectionAcceptor(Connections::FROM_FD,
                                                                         grpc::InsecureServerCredentials());
  for (const auto& service : state->gated) builder.RegisterService(service.get());
  state->poller.emplace(builder);
  gpr_set_log_function(pass_on);
  // protobuf logs each text that is not UTF-8. The client gets the error and must not fill the log.
  google::protobuf::SetLogHandler(nullptr);
  state->server = builder.BuildAndStart();
  if (state->server == nullptr) return hal::Error{"gRPC does not start", config.listen.text(), "", "", ""};
  state->poller->start();
  state->start_relays(std::move(tls), parts.policy);
  ConnectionListener::Takers takers;
  takers.take = [here = state.get()](int descriptor, ConnectionKind kind) {
    if (kind == ConnectionKind::kTls) {
      Identity stranger;
      stranger.peer = address_of_peer(descriptor);
      here->tls_relay->take(descriptor, std::move(stranger));
    } else {
      here->relay->take(descriptor, here->local_clients->identify(descriptor, kind));
    }
  };
  takers.has_room = [here = state.get()](ConnectionKind kind) {
    return (kind == ConnectionKind::kTls ? here->tls_relay : here->relay)->has_room();
  };
  state->listener->start(std::move(takers));
  std::unique_ptr<GrpcServer> server(new GrpcServer(std::move(state)));
  server->set_serving(false);
  return server;
}

std::uint16_t GrpcServer::port() const {
  return state_->listener->port();
}

std::uint16_t GrpcServer::tls_port() const {
  return state_->listener->tls_port();
}

void GrpcServer::set_serving(bool serving) {
  if (auto* health = state_->server->GetHealthCheckService()) health->SetServingStatus(serving);
}

void GrpcServer::shutdown(std::chrono::milliseconds timeout) {
  state_->listener->stop();
  state_->server->Shutdown(std::chrono::system_clock::now() + timeout);
  state_->server->Wait();
  state_->relay.reset();
  state_->tls_relay.reset();
}

StopSockets GrpcServer::take_stop_sockets() {
  return state_->listener->take_stop_sockets();
}

const std::string& GrpcServer::unix_group() const {
  return state_->listener->unix_group();
}

}  // namespace hapticd::server
