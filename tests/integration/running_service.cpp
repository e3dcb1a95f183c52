#include "tests/integration/running_service.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>
#include <thread>

#include "tests/support/quiet_loop.h"

namespace hapticd::test {

testing::AssertionResult ok(const grpc::Status& status) {
  if (status.ok()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << status.error_message();
}

std::unique_ptr<grpc::ClientContext> call_context(std::chrono::milliseconds timeout) {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(std::chrono::system_clock::now() + timeout);
  return context;
}

std::shared_ptr<grpc::Channel> connect(const std::string& address, Window window) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (window == Window::kFixed) {
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 65535);
  }
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

server::DaemonConfig quiet_config() {
  server::DaemonConfig config;
  config.loop = test::quiet_loop();
  config.listen.port = 0;
  config.log_level = server::LogLevel::kWarning;
  return config;
}

server::DaemonConfig config_with_scene(const std::string& name) {
  server::DaemonConfig config = quiet_config();
  config.scene = name;
  return config;
}

server::DaemonConfig generous_config() {
  server::DaemonConfig config = quiet_config();
  config.guard.max_target_stiffness_n_per_mm = 20.0;
  config.guard.min_target_ramp_s = 0.0;
  config.guard.max_target_change_n_per_s = 1e6;
  return config;
}

server::DaemonConfig config_that_records(const std::string& folder) {
  server::DaemonConfig config = quiet_config();
  config.recording.folder = folder;
  config.recording.keep_free_mb = 0.0;
  return config;
}

server::DaemonConfig config_with_certificates(const std::string& folder) {
  server::DaemonConfig config = quiet_config();
  config.listen_tls = server::ListenAddress{"127.0.0.1", 0};
  config.certificates = folder;
  return config;
}

server::DaemonConfig config_that_replays(const std::string& path) {
  server::DaemonConfig config = quiet_config();
  config.rig = server::RigChoice::kReplay;
  config.replay.path = path;
  config.replay.loop = true;
  return config;
}

server::DaemonConfig config_with_table(std::vector<hal::TurntableStation> stations) {
  server::DaemonConfig config = quiet_config();
  config.turntable.kind = server::TurntableChoice::kSimulated;
  config.turntable.interlock.sensor_silence_s = config.turntable.interlock.loop_silence_s = 10.0;
  config.turntable.settings.stale_after_s = 2.0;
  config.turntable.settings.stations = std::move(stations);
  return config;
}

bool is_latched(const v1::RigState& state) {
  return state.guard_state() == v1::GUARD_STATE_LATCHED;
}

ServiceClient::ServiceClient(std::shared_ptr<grpc::Channel> connection)
    : channel(std::move(connection)),
      rig(v1::RigService::NewStub(channel)),
      scene(v1::SceneService::NewStub(channel)),
      model(v1::ModelService::NewStub(channel)),
      rendering(v1::RenderingService::NewStub(channel)),
      telemetry(v1::TelemetryService::NewStub(channel)),
      simulation(v1::SimulationService::NewStub(channel)),
      safety(v1::SafetyService::NewStub(channel)) {}

v1::RigState ServiceClient::state() const {
  v1::RigState state;
  EXPECT_TRUE(ok(rig->GetRigState(call_context().get(), {}, &state)));
  return state;
}

grpc::Status ServiceClient::load(const std::string& name, v1::LoadSceneResponse* response) const {
  v1::LoadSceneRequest request;
  request.set_name(name);
  v1::LoadSceneResponse unused;
  return scene->LoadScene(call_context().get(), request, response != nullptr ? response : &unused);
}

grpc::Status ServiceClient::load_toml(const std::string& toml) const {
  v1::LoadSceneRequest request;
  request.set_toml(toml);
  v1::LoadSceneResponse unused;
  return scene->LoadScene(call_context().get(), request, &unused);
}

grpc::Status ServiceClient::set_target(const v1::SetTargetRequest& request,
                                       v1::SetTargetResponse* response) const {
  v1::SetTargetResponse unused;
  return rendering->SetTarget(call_context().get(), request, response != nullptr ? response : &unused);
}

grpc::Status ServiceClient::stop(const v1::StopRequest& request) const {
  v1::StopResponse unused;
  return safety->Stop(call_context().get(), request, &unused);
}

grpc::Status ServiceClient::clear() const {
  v1::ClearResponse unused;
  return safety->Clear(call_context().get(), {}, &unused);
}

void ServiceClient::set_hand(v1::HandProgramKind kind,
                             const std::function<void(v1::HandProgram&)>& rest) const {
  v1::SetHandProgramRequest request;
  request.mutable_program()->set_kind(kind);
  if (rest) rest(*request.mutable_program());
  answer_of(*simulation, &v1::SimulationService::Stub::SetHandProgram, request);
}

void ServiceClient::watch(v1::SubscribeRequest request,
                          const std::function<bool(const v1::TelemetrySample&)>& sample) const {
  const auto context = call_context();
  const auto reader = telemetry->Subscribe(context.get(), request);
  v1::TelemetryBatch batch;
  for (bool more = true; more && reader->Read(&batch);) {
    for (auto each = batch.samples().begin(); more && each != batch.samples().end(); ++each) {
      more = sample(*each);
    }
  }
  context->TryCancel();
  reader->Finish();
}

v1::RigState ServiceClient::await(const Condition& condition) const {
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  for (;;) {
    v1::RigState now = state();
    if (condition(now)) return now;
    if (std::chrono::steady_clock::now() > until) {
      ADD_FAILURE() << "waited in vain; the last state was\n" << now.DebugString();
      return now;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // politeness between two looks
  }
}

namespace {

std::unique_ptr<server::Daemon> started(const server::DaemonConfig& config) {
  server::StartFailure failure;
  const auto checked = server::override_config(config, {});
  if (!checked) throw std::runtime_error(checked.error().text());
  auto daemon = server::Daemon::start(*checked, failure);
  if (!daemon) throw std::runtime_error(failure.error.text());
  return daemon;
}

}  // namespace

RunningService::RunningService(const server::DaemonConfig& config) : RunningService(started(config)) {}

RunningService::RunningService(std::unique_ptr<server::Daemon> running)
    : ServiceClient(connect("127.0.0.1:" + std::to_string(running->port()))), daemon(std::move(running)) {
  // It ends no daemon, either: OpenSSL writes to what may be closed. Caught rather than ignored, so that the
  // programs that a test starts get it.
  std::signal(SIGPIPE, [](int) {});
}

v1::RigState RunningService::press(double force_n, const Condition& pressed) const {
  constexpr std::chrono::seconds kPressTimeout{5};
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  v1::RigState now;
  while (std::chrono::steady_clock::now() < until) {
    set_hand(v1::HAND_PROGRAM_KIND_PRESS, [&](v1::HandProgram& program) {
      program.set_force_n(force_n);
      program.set_hold_s(-1.0);
    });
    const auto again = std::chrono::steady_clock::now() + kPressTimeout;
    while (std::chrono::steady_clock::now() < again) {
      now = state();
      if (pressed(now)) return now;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));  // politeness between two looks
    }
  }
  ADD_FAILURE() << "pressed in vain; the last state was\n" << now.DebugString();
  return now;
}

}  // namespace hapticd::test
