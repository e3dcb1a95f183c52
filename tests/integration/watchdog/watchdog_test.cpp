// The dead man, over the network.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <limits>
#include <thread>

#include "client/cpp/watchdog/watchdog_endpoint.h"
#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/watchdog.grpc.pb.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/support/child_process.h"
#include "tests/support/eventually.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

constexpr double kShortMs = 300.0;
/// Timeout so long that a machine that stalls makes no endpoint miss it.
constexpr double kLongMs = 60000.0;

server::DaemonConfig watched(std::vector<server::EndpointConfig> endpoints) {
  server::DaemonConfig config = quiet_config();
  config.watchdog.endpoints = std::move(endpoints);
  return config;
}

client::Client client_of(const RunningService& service) {
  return client::Client({.address = service.address(), .timeout = std::chrono::milliseconds(kTimeout)});
}

bool has_fault(const v1::RigState& state, v1::GuardFault fault) {
  return std::find(state.faults_present().begin(), state.faults_present().end(), fault) !=
         state.faults_present().end();
}

/// Clears once the loop has seen that everyone is there.
void clear_when_possible(const RunningService& service) {
  EXPECT_TRUE(eventually([&] {
    const grpc::Status status = service.clear();
    if (!status.ok()) expect_refused_for(status, status.error_code(), v1::ERROR_REASON_FAULT_PERSISTS);
    return status.ok();
  }));
  service.await([](const v1::RigState& state) { return state.guard_state() == v1::GUARD_STATE_RENDERING; });
}

TEST(WatchdogService, WithoutEndpointsNothingChanges) {
  const RunningService service;
  client::Client client = client_of(service);
  EXPECT_TRUE(client.watchdog().endpoints().empty());
  EXPECT_FALSE(is_latched(service.state()));
  client::WatchdogEndpoint endpoint(client, "pedal");
  const client::Error error = thrown_by<client::Error>([&] { endpoint.check_in(); });
  EXPECT_EQ(error.detail().reason(), v1::ERROR_REASON_NOT_FOUND);
}

TEST(WatchdogService, NoForceFromTheStartUntilAllAreThere) {
  const RunningService service(watched({{"a", kLongMs, false}, {"b", kLongMs, false}}));
  const v1::RigState first = service.await(is_latched);
  EXPECT_EQ(first.guard_fault(), v1::GUARD_FAULT_ENDPOINT_MISSING);
  ASSERT_EQ(first.watchdog_endpoints_size(), 2);
  EXPECT_EQ(first.watchdog_endpoints(0).state(), v1::ENDPOINT_STATE_AWAITED);
  ASSERT_TRUE(service.load("tap_1d").ok());
  const grpc::Status refused = service.clear();
  EXPECT_EQ(detail_of(refused).reason(), v1::ERROR_REASON_FAULT_PERSISTS);
  EXPECT_NE(detail_of(refused).value().find("'a' has not checked in yet"), std::string::npos)
      << detail_of(refused).value();

  client::Client client = client_of(service);
  client::WatchdogEndpoint a(client, "a");
  client::WatchdogEndpoint b(client, "b");
  a.check_in();
  EXPECT_EQ(detail_of(service.clear()).reason(), v1::ERROR_REASON_FAULT_PERSISTS) << "one is not all";
  b.check_in();
  service.await(
      [](const v1::RigState& state) { return !has_fault(state, v1::GUARD_FAULT_ENDPOINT_MISSING); });
  EXPECT_TRUE(is_latched(service.state())) << "only an operator clears";
  clear_when_possible(service);
  EXPECT_EQ(client.watchdog().endpoints(1).state(), v1::ENDPOINT_STATE_ALIVE);
}

TEST(WatchdogService, AReleasedPedalCutsTheForceInOneTick) {
  const RunningService service(watched({{"pedal", kLongMs, true}}));
  client::Client client = client_of(service);
  client::WatchdogEndpoint pedal(client, "pedal");
  pedal.check_in(true);
  ASSERT_TRUE(service.load("tap_1d").ok());
  clear_when_possible(service);
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(0.8);
  ASSERT_TRUE(service.set_target(target).ok());
  service.press(3.0);
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_GUARD);
  bool released = false;
  service.watch(request, [&](const v1::TelemetrySample& sample) {
    const v1::Vector3& force = sample.guard().device_command_n();
    const double most_n = std::max({std::abs(force.x()), std::abs(force.y()), std::abs(force.z())});
    if (sample.guard().state() == v1::GUARD_STATE_LATCHED) {
      EXPECT_EQ(sample.guard().fault(), v1::GUARD_FAULT_PEDAL_RELEASED);
      EXPECT_EQ(most_n, 0.0);
      return false;
    }
    if (!released && most_n > 0.1) {
      pedal.check_in(false);
      released = true;
    }
    return true;
  });
  EXPECT_TRUE(released) << "no force was rendered";
  const grpc::Status refused = service.clear();
  EXPECT_EQ(detail_of(refused).value(), "endpoint 'pedal' reports its pedal released");
  pedal.check_in(true);
  clear_when_possible(service);
}

TEST(WatchdogService, AReleaseThatIsOverAtOnceLatchesToo) {
  const RunningService service(watched({{"pedal", kLongMs, true}}));
  client::Client client = client_of(service);
  client::WatchdogEndpoint pedal(client, "pedal");
  pedal.check_in(true);
  for (int round = 0; round < 5; ++round) {
    clear_when_possible(service);
    pedal.check_in(false);
    pedal.check_in(true);
    EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_PEDAL_RELEASED);
  }
}

TEST(WatchdogService, WhoStopsToCheckInIsMissing) {
  const RunningService service(watched({{"a", kShortMs, false}, {"b", kLongMs, false}}));
  client::Client client = client_of(service);
  client::WatchdogEndpoint a(client, "a");
  client::WatchdogEndpoint b(client, "b");
  b.check_in();
  std::atomic<bool> holds{true};
  std::thread holder([&] {
    while (holds) {
      a.check_in();
      std::this_thread::sleep_for(a.pause() / 4);
    }
  });
  clear_when_possible(service);
  holds = false;
  holder.join();
  const v1::RigState lost = service.await(is_latched);
  EXPECT_EQ(lost.guard_fault(), v1::GUARD_FAULT_ENDPOINT_MISSING);
  const v1::RigState seen = service.await([](const v1::RigState& state) {
    return state.watchdog_endpoints(0).state() == v1::ENDPOINT_STATE_MISSING;
  });
  EXPECT_GE(seen.watchdog_endpoints(0).silent_ms(), kShortMs);
  EXPECT_EQ(seen.watchdog_endpoints(1).state(), v1::ENDPOINT_STATE_ALIVE);
}

TEST(WatchdogService, RefusesWhatCannotBe) {
  const RunningService service(watched({{"pedal", kLongMs, true}}));
  const auto stub = v1::WatchdogService::NewStub(service.channel);
  const auto send = [&](const v1::CheckInRequest& request) {
    v1::CheckInResponse response;
    return stub->CheckIn(call_context().get(), request, &response).error_code();
  };
  v1::CheckInRequest request;
  EXPECT_EQ(send(request), grpc::StatusCode::NOT_FOUND);
  request.set_endpoint(std::string(100'000, 'x'));
  EXPECT_EQ(send(request), grpc::StatusCode::NOT_FOUND);
  request.set_endpoint("pedal");
  EXPECT_EQ(send(request), grpc::StatusCode::INVALID_ARGUMENT) << "no sender";
  request.set_sender(std::numeric_limits<std::uint64_t>::max());
  request.set_nonce(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(send(request), grpc::StatusCode::INVALID_ARGUMENT) << "pressed or not";
  request.set_pressed(true);
  EXPECT_EQ(send(request), grpc::StatusCode::ABORTED) << "a number that was not given out";
  EXPECT_EQ(client_of(service).watchdog().endpoints(0).wrong_nonces(), 1U);
  EXPECT_EQ(service.state().watchdog_endpoints(0).state(), v1::ENDPOINT_STATE_AWAITED);
}

TEST(WatchdogService, AnObserverCannotAllowForce) {
  server::DaemonConfig config = watched({{"a", kLongMs, false}});
  config.access.local_role = server::Role::kObserver;
  const RunningService service(config);
  client::Client client = client_of(service);
  EXPECT_EQ(client.watchdog().endpoints_size(), 1);
  client::WatchdogEndpoint a(client, "a");
  EXPECT_THROW(a.check_in(), client::Error);
}

TEST(WatchdogService, TheLeaseOfAnotherDoesNotMatter) {
  const RunningService service(watched({{"a", kLongMs, false}}));
  AccessClient holder(connect(service.address()));
  ASSERT_TRUE(holder.acquire().ok());
  client::Client client = client_of(service);
  client::WatchdogEndpoint a(client, "a");
  a.check_in();
  EXPECT_THROW(client.load_scene({.name = "tap_1d"}), client::Error) << "the lease is another's";
  service.await(
      [](const v1::RigState& state) { return !has_fault(state, v1::GUARD_FAULT_ENDPOINT_MISSING); });
  v1::ClearResponse cleared;
  EXPECT_TRUE(holder.safety->Clear(holder.context().get(), {}, &cleared).ok());
}

TEST(WatchdogService, EndsTheForceOfAnIdentification) {
  const RunningService service(watched({{"pedal", kLongMs, true}}));
  client::Client client = client_of(service);
  v1::StartIdentificationRequest request;
  request.mutable_tool();
  client::WatchdogEndpoint pedal(client, "pedal");
  pedal.check_in(true);
  clear_when_possible(service);
  client.start_identification(request);
  pedal.check_in(false);
  EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_PEDAL_RELEASED);
}

TEST(WatchdogService, AnEndpointOutlivesARestartOfTheDaemon) {
  server::DaemonConfig config = watched({{"a", kLongMs, false}});
  auto service = std::make_unique<RunningService>(config);
  client::Client client = client_of(*service);
  client::WatchdogEndpoint a(client, "a");
  a.check_in();
  clear_when_possible(*service);
  config.listen.port = service->daemon->port();
  service.reset();
  EXPECT_THROW(a.check_in(), client::Error) << "no daemon";
  service = std::make_unique<RunningService>(config);
  EXPECT_EQ(service->await(is_latched).guard_fault(), v1::GUARD_FAULT_ENDPOINT_MISSING)
      << "a new daemon awaits all";
  ASSERT_TRUE(eventually([&] {
    try {
      a.check_in();
      return true;
    } catch (const client::Error&) {
      return false;  // it connects again
    }
  }));
  clear_when_possible(*service);
}

#ifdef HAPTICCTL_BINARY  // where hapticctl is built
TEST(WatchdogService, AHolderWhoseProcessIsStoppedIsMissing) {
  const RunningService service(watched({{"a", 1000.0, false}}));
  ChildProcess holder(HAPTICCTL_BINARY, {"--server", service.address(), "watchdog", "hold", "a"});
  clear_when_possible(service);
  holder.signal(SIGSTOP);
  EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_ENDPOINT_MISSING);
  holder.signal(SIGCONT);
  clear_when_possible(service);
  holder.signal(SIGTERM);
  EXPECT_EQ(holder.wait(), 0);
}

TEST(WatchdogService, AHolderMayBeStartedAgainAtOnce) {
  const RunningService service(watched({{"a", 1500.0, false}}));
  {
    ChildProcess first(HAPTICCTL_BINARY, {"--server", service.address(), "watchdog", "hold", "a"});
    clear_when_possible(service);
    first.signal(SIGKILL);
    first.wait();
  }
  ChildProcess second(HAPTICCTL_BINARY, {"--server", service.address(), "watchdog", "hold", "a"});
  service.await(is_latched);  // the first one lapses, the second waits for that
  clear_when_possible(service);
  second.signal(SIGTERM);
  EXPECT_EQ(second.wait(), 0);
}
#endif

}  // namespace
}  // namespace hapticd::test
