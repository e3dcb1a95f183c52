#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "hal/turntable.h"
#include "hapticd/v1/model.grpc.pb.h"
#include "hapticd/v1/rendering.grpc.pb.h"
#include "hapticd/v1/rig.grpc.pb.h"
#include "hapticd/v1/safety.grpc.pb.h"
#include "hapticd/v1/scene.grpc.pb.h"
#include "hapticd/v1/simulation.grpc.pb.h"
#include "hapticd/v1/telemetry.grpc.pb.h"
#include "server/config/config.h"
#include "server/daemon.h"

namespace hapticd::test {

/// How long a test waits for what must happen; far beyond what it takes, so that a slow machine fails no
/// test.
inline constexpr std::chrono::seconds kTimeout{60};

/// Whether a call succeeded; if not, with what it was refused.
testing::AssertionResult ok(const grpc::Status& status);

/// A context whose call ends in an error rather than never.
std::unique_ptr<grpc::ClientContext> call_context(std::chrono::milliseconds timeout = kTimeout);

/// Answer of a call that has to succeed; throws std::runtime_error with its status otherwise.
template <class Stub, class Request, class Response>
Response answer_of(Stub& stub, grpc::Status (Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                   const std::type_identity_t<Request>& request = {}) {
  Response response;
  const grpc::Status status = (stub.*call)(call_context().get(), request, &response);
  if (!status.ok()) throw std::runtime_error(status.error_message());
  return response;
}

/// Window of a separate connection, shared with no other channel. With a fixed window no more than 64 KiB of
/// a stream are on the way to a client that does not read; otherwise gRPC lets it grow to megabytes.
enum class Window { kGrowing, kFixed };
std::shared_ptr<grpc::Channel> connect(const std::string& address, Window window = Window::kGrowing);

/// The simulated rig on a free port, without any of the privileges a loop would like.
server::DaemonConfig quiet_config();

/// Quiet configuration with this scene loaded.
server::DaemonConfig config_with_scene(const std::string& name);

/// Configuration with ceilings that leave room for tests of what lies below them: stiff targets, no floor of
/// their ramps.
server::DaemonConfig generous_config();

/// Configuration that records into this folder, however full the disk is.
server::DaemonConfig config_that_records(const std::string& folder);

/// Configuration that also listens with the certificates of this folder.
server::DaemonConfig config_with_certificates(const std::string& folder);

/// Configuration that plays this recording again and again.
server::DaemonConfig config_that_replays(const std::string& path);

/// Configuration with a simulated turntable that knows these stations; a stall of the machine does not count
/// as its fault.
server::DaemonConfig config_with_table(std::vector<hal::TurntableStation> stations);

using Condition = std::function<bool(const v1::RigState&)>;

/// Returns true if the guard has cut the force.
bool is_latched(const v1::RigState& state);

/// Reads a stream to its end, into `last`.
template <class Message>
grpc::Status read_all(grpc::ClientReader<Message>& reader, Message& last) {
  while (reader.Read(&last)) {
  }
  return reader.Finish();
}

/// A client's view of a daemon.
class ServiceClient {
 public:
  explicit ServiceClient(std::shared_ptr<grpc::Channel> connection);

  v1::RigState state() const;
  grpc::Status load(const std::string& name, v1::LoadSceneResponse* response = nullptr) const;
  grpc::Status load_toml(const std::string& toml) const;
  grpc::Status set_target(const v1::SetTargetRequest& request,
                          v1::SetTargetResponse* response = nullptr) const;
  grpc::Status stop(const v1::StopRequest& request = {}) const;
  grpc::Status clear() const;
  /// Gives the simulated hand a program of this kind; `rest` fills in what else it has.
  void set_hand(v1::HandProgramKind kind, const std::function<void(v1::HandProgram&)>& rest = {}) const;
  /// Reads telemetry until `sample` returns false.
  void watch(v1::SubscribeRequest request,
             const std::function<bool(const v1::TelemetrySample&)>& sample) const;
  /// Looks at the rig's state until `condition` holds; fails the test when it never does.
  v1::RigState await(const Condition& condition) const;

  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::RigService::Stub> rig;
  std::unique_ptr<v1::SceneService::Stub> scene;
  std::unique_ptr<v1::ModelService::Stub> model;
  std::unique_ptr<v1::RenderingService::Stub> rendering;
  std::unique_ptr<v1::TelemetryService::Stub> telemetry;
  std::unique_ptr<v1::SimulationService::Stub> simulation;
  std::unique_ptr<v1::SafetyService::Stub> safety;
};

/// A daemon in this process, and a client's view of it.
class RunningService : public ServiceClient {
 public:
  explicit RunningService(const server::DaemonConfig& config = quiet_config());

  std::string address() const { return "127.0.0.1:" + std::to_string(daemon->port()); }
  /// Has the hand press with `force_n` and hold until `pressed`. A machine that stalls while the hand comes
  /// down makes the scene wait until the tool is free: then it is lifted and pressed again.
  v1::RigState press(double force_n, const Condition& pressed = &v1::RigState::in_contact) const;

  std::unique_ptr<server::Daemon> daemon;

 private:
  explicit RunningService(std::unique_ptr<server::Daemon> running);
};

}  // namespace hapticd::test
