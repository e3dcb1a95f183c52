#pragma once

// Internal to the library: the gRPC side of a client.

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "client/cpp/channel.h"
#include "client/cpp/client.h"
#include "client/cpp/lease_keeper.h"
#include "client/cpp/server_stream.h"
#include "hapticd/v1/access.grpc.pb.h"
#include "hapticd/v1/calibration.grpc.pb.h"
#include "hapticd/v1/clock.grpc.pb.h"
#include "hapticd/v1/event.grpc.pb.h"
#include "hapticd/v1/experiment.grpc.pb.h"
#include "hapticd/v1/guide.grpc.pb.h"
#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/model.grpc.pb.h"
#include "hapticd/v1/pose.grpc.pb.h"
#include "hapticd/v1/presentation.grpc.pb.h"
#include "hapticd/v1/recording.grpc.pb.h"
#include "hapticd/v1/rendering.grpc.pb.h"
#include "hapticd/v1/rig.grpc.pb.h"
#include "hapticd/v1/safety.grpc.pb.h"
#include "hapticd/v1/scene.grpc.pb.h"
#include "hapticd/v1/simulation.grpc.pb.h"
#include "hapticd/v1/telemetry.grpc.pb.h"
#include "hapticd/v1/turntable.grpc.pb.h"
#include "hapticd/v1/watchdog.grpc.pb.h"

namespace hapticd::client {

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
        calibration(v1::CalibrationService::NewStub(channel)),
        turntable(v1::TurntableService::NewStub(channel)),
        presentation(v1::PresentationService::NewStub(channel)),
        access(v1::AccessService::NewStub(channel)),
        watchdog(v1::WatchdogService::NewStub(channel)),
        clock(v1::ClockService::NewStub(channel)),
        recording(v1::RecordingService::NewStub(channel)),
        event(v1::EventService::NewStub(channel)),
        experiment(v1::ExperimentService::NewStub(channel)),
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

  /// Prepares a command that is answered with a stream: its refusal would come too late to do something about
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
  std::unique_ptr<v1::CalibrationService::Stub> calibration;
  std::unique_ptr<v1::TurntableService::Stub> turntable;
  std::unique_ptr<v1::PresentationService::Stub> presentation;
  std::unique_ptr<v1::AccessService::Stub> access;
  std::unique_ptr<v1::WatchdogService::Stub> watchdog;
  std::unique_ptr<v1::ClockService::Stub> clock;
  std::unique_ptr<v1::RecordingService::Stub> recording;
  std::unique_ptr<v1::EventService::Stub> event;
  std::unique_ptr<v1::ExperimentService::Stub> experiment;
  std::unique_ptr<LeaseKeeper> keeper;
};

}  // namespace hapticd::client
