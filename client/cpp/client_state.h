#pragma once

// Internal to the library: the gRPC side of a client.

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <tuple>
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

/// The stubs of services on one channel.
template <class... Services>
class Stubs {
 public:
  explicit Stubs(const std::shared_ptr<grpc::Channel>& channel) : stubs_(Services::NewStub(channel)...) {}

  template <class Stub>
  Stub& get() const {
    return *std::get<std::unique_ptr<Stub>>(stubs_);
  }

 private:
  std::tuple<std::unique_ptr<typename Services::Stub>...> stubs_;
};

struct Client::State {
  explicit State(ClientOptions given)
      : options(std::move(given)),
        channel(open_channel(options)),
        stubs(channel),
        keeper(std::make_unique<LeaseKeeper>(channel, options.lease_token)) {}

  template <class Stub, class Request, class Response>
  using Unary = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);
  template <class Stub, class Request, class Message>
  using Streamed = std::unique_ptr<grpc::ClientAsyncReader<Message>> (Stub::*)(grpc::ClientContext*,
                                                                               const Request&,
                                                                               grpc::CompletionQueue*, void*);

  /// One unary call: `method` of its service's stub with a deadline; its answer, or an Error thrown.
  template <class Stub, class Request, class Response>
  Response call(Unary<Stub, Request, Response> method, const Request& request,
                std::chrono::nanoseconds extra_time = {}) {
    try {
      return call_once(method, request, extra_time);
    } catch (const Error& error) {
      const bool can_help =
          options.acquires_lease && error.detail().reason() == v1::ERROR_REASON_LEASE_REQUIRED;
      if (!can_help) throw;
    }
    acquire_for_commands();
    return call_once(method, request, extra_time);
  }

  /// A call that is answered with a stream of messages; `method` is the stub's Async… of it.
  template <class Stub, class Request, class Message>
  std::unique_ptr<ServerStream<Message>> stream(Streamed<Stub, Request, Message> method,
                                                const Request& request) const {
    return std::make_unique<ServerStream<Message>>(
        std::make_shared<Stub>(channel), options.address,
        [&](Stub& on, grpc::ClientContext* context, grpc::CompletionQueue* queue) {
          keeper->add_to(*context);
          return (on.*method)(context, request, queue, nullptr);
        });
  }

  template <class Stub, class Request, class Response>
  Response call_once(Unary<Stub, Request, Response> method, const Request& request,
                     std::chrono::nanoseconds extra_time) {
    grpc::ClientContext context;
    keeper->add_to(context);
    context.set_deadline(std::chrono::system_clock::now() + options.timeout +
                         std::chrono::duration_cast<std::chrono::milliseconds>(extra_time));
    Response response;
    const grpc::Status status = (stubs.get<Stub>().*method)(&context, request, &response);
    if (!status.ok()) {
      throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                              status.error_details(), options.address);
    }
    return response;
  }

  void acquire_for_commands() {
    v1::AcquireLeaseRequest request;
    request.set_purpose(options.lease_purpose);
    keeper->keep(call_once(&v1::LeaseService::Stub::AcquireLease, request, {}));
  }

  /// Prepares a command that is answered with a stream: its refusal would come too late to do something about
  /// it.
  void prepare_command() {
    if (!options.acquires_lease || !keeper->token().empty()) return;
    const v1::Access mine = call(&v1::AccessService::Stub::GetAccess, v1::GetAccessRequest());
    if (mine.lease_rule() == v1::LEASE_RULE_REQUIRED) acquire_for_commands();
  }

  ClientOptions options;
  std::shared_ptr<grpc::Channel> channel;
  Stubs<v1::RigService, v1::SceneService, v1::ModelService, v1::RenderingService, v1::SafetyService,
        v1::SimulationService, v1::IdentificationService, v1::CalibrationService, v1::TurntableService,
        v1::PresentationService, v1::AccessService, v1::WatchdogService, v1::ClockService,
        v1::RecordingService, v1::EventService, v1::ExperimentService, v1::LeaseService>
      stubs;
  std::unique_ptr<LeaseKeeper> keeper;
};

}  // namespace hapticd::client
