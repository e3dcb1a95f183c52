// Clients that all call at the same time: what two calls share is guarded. ThreadSanitizer looks on.

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "hapticd/v1/access.grpc.pb.h"
#include "hapticd/v1/clock.grpc.pb.h"
#include "hapticd/v1/event.grpc.pb.h"
#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/recording.grpc.pb.h"
#include "hapticd/v1/watchdog.grpc.pb.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

constexpr int kClients = 4;  ///< that call, and as many that listen
constexpr int kRounds = 100;
constexpr int kBatches = 300;

/// Calls a method whose request may be empty; it is served.
template <class Service, class Request, class Response>
void call(ServiceClient& client,
          grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  Response response;
  const auto stub = Service::NewStub(client.channel);
  EXPECT_TRUE(ok(((*stub).*method)(call_context().get(), Request(), &response)));
}

void ask(const std::string& address) {
  ServiceClient client(connect(address));
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(0.5);
  for (int round = 0; round < kRounds; ++round) {
    client.state();
    EXPECT_TRUE(ok(client.set_target(target)));
    call<v1::RigService>(client, &v1::RigService::Stub::GetRigInfo);
    call<v1::SceneService>(client, &v1::SceneService::Stub::ListScenes);
    call<v1::ModelService>(client, &v1::ModelService::Stub::ListModels);
    call<v1::LeaseService>(client, &v1::LeaseService::Stub::GetLease);
    call<v1::AccessService>(client, &v1::AccessService::Stub::GetAccess);
    call<v1::EventService>(client, &v1::EventService::Stub::ListEvents);
    call<v1::ClockService>(client, &v1::ClockService::Stub::Exchange);
    call<v1::RecordingService>(client, &v1::RecordingService::Stub::ListRecordings);
    call<v1::WatchdogService>(client, &v1::WatchdogService::Stub::GetWatchdog);
    call<v1::IdentificationService>(client, &v1::IdentificationService::Stub::ListIdentifications);
  }
}

void listen(const std::string& address) {
  const ServiceClient client(connect(address));
  const auto context = call_context();
  v1::SubscribeRequest request;
  request.set_batch_size(1);
  const auto reader = client.telemetry->Subscribe(context.get(), request);
  v1::TelemetryBatch batch;
  for (int i = 0; i < kBatches; ++i) ASSERT_TRUE(reader->Read(&batch));
  context->TryCancel();
}

TEST(Crowd, OfClientsIsServed) {
  const TemporaryFolder folder;
  const RunningService service(config_that_records(folder.path()));
  ASSERT_TRUE(ok(service.load("tap_1d")));
  std::vector<std::thread> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back(ask, service.address());
    clients.emplace_back(listen, service.address());
  }
  for (std::thread& client : clients) client.join();
}

}  // namespace
}  // namespace hapticd::test
