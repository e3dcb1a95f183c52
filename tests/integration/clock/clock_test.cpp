// The daemon's clock, over the network. Client and daemon share one machine, so the true offset is 0.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <string>

#include "client/cpp/clock/clock_sync.h"
#include "hapticd/v1/clock.grpc.pb.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

client::Client clock_client(const std::string& address) {
  return client::Client({.address = address, .timeout = std::chrono::milliseconds(kTimeout)});
}

/// Waits for so many exchanges.
void await_exchanges(const client::ClockSync& clock, std::uint64_t count) {
  ASSERT_TRUE(eventually([&] { return clock.exchanges() >= count; }));
}

TEST(ClockService, TheTrueOffsetIsWithinTheBounds) {
  const RunningService service;
  client::Client client = clock_client(service.address());
  const client::ClockSync clock(client);
  std::int64_t last_ns = 0;
  for (std::uint64_t count = 1; count <= 50; ++count) {
    await_exchanges(clock, count);
    const client::ClockBounds bounds = clock.bounds();
    EXPECT_LE(bounds.lower_ns, 0);
    EXPECT_GE(bounds.upper_ns, 0);
    const std::int64_t now_ns = client::ClockSync::now_ns();
    const client::DaemonTime converted = clock.to_daemon(now_ns);
    EXPECT_LE(std::abs(converted.daemon_ns - now_ns),
              static_cast<std::int64_t>(1e6 * converted.bound_ms) + 1);
    EXPECT_GE(converted.daemon_ns, last_ns);
    last_ns = converted.daemon_ns;
  }
  EXPECT_FALSE(clock.problem());
}

TEST(ClockService, EchoesAnyStamp) {
  const RunningService service;
  const auto stub = v1::ClockService::NewStub(service.channel);
  for (const std::int64_t stamp : {std::int64_t{0}, std::numeric_limits<std::int64_t>::min(),
                                   std::numeric_limits<std::int64_t>::max()}) {
    v1::ExchangeRequest request;
    request.set_client_sent_ns(stamp);
    const v1::ExchangeResponse response = answer_of(*stub, &v1::ClockService::Stub::Exchange, request);
    EXPECT_EQ(response.client_sent_ns(), stamp);
    EXPECT_GT(response.daemon_received_ns(), 0);
    EXPECT_GE(response.daemon_sent_ns(), response.daemon_received_ns());
    EXPECT_FALSE(response.clock().empty());
  }
}

TEST(ClockService, StatesItsRelationToUtc) {
  const RunningService service;
  client::Client client = clock_client(service.address());
  using std::chrono::nanoseconds;
  const auto utc_ns = [] { return nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count(); };
  const std::int64_t before = client::ClockSync::now_ns();
  const v1::ClockState state = client.clock();
  const std::int64_t after = client::ClockSync::now_ns();
  EXPECT_GE(state.monotonic_ns(), before);
  EXPECT_LE(state.monotonic_ns(), after);
  constexpr std::int64_t kMinuteNs = 60'000'000'000;
  EXPECT_LT(std::abs(state.utc_ns() - utc_ns()), kMinuteNs);
  EXPECT_GE(state.read_apart_ns(), 0);
  EXPECT_NE(state.utc_state(), v1::UTC_STATE_UNSPECIFIED);
  EXPECT_GE(state.kept_by_size(), 1);
}

TEST(ClockService, BoundsOutliveARestartOfTheDaemon) {
  server::DaemonConfig config = quiet_config();
  auto service = std::make_unique<RunningService>(config);
  client::Client client = clock_client(service->address());
  const client::ClockSync clock(client);
  await_exchanges(clock, 5);
  config.listen.port = service->daemon->port();
  service.reset();
  EXPECT_TRUE(eventually([&] { return clock.problem().has_value(); })) << "no daemon answers";
  const client::ClockBounds alone = clock.bounds();
  EXPECT_LE(alone.lower_ns, 0);
  EXPECT_GE(alone.upper_ns, 0);
  service = std::make_unique<RunningService>(config);
  await_exchanges(clock, clock.exchanges() + 2);
  EXPECT_LE(clock.bounds().lower_ns, 0);
  EXPECT_GE(clock.bounds().upper_ns, 0);
}

TEST(ClockService, TheRigsTimeIsWithinItsBounds) {
  server::DaemonConfig config = quiet_config();
  config.simulation.real_time = true;
  const RunningService service(config);
  client::Client client = clock_client(service.address());
  const client::ClockSync clock(client);
  await_exchanges(clock, 20);
  std::int64_t last_ns = 0;
  for (int i = 0; i < 200; ++i) {
    // The loop's last tick lies between a time before the question and one after it; it is at most so old as
    // the loop is late.
    const v1::RigState state = client.rig_state(client::Histograms::kWithout);
    const std::int64_t after_ns = client::ClockSync::now_ns();
    const client::RigTime now = clock.to_rig(after_ns);
    EXPECT_LE(state.time_ns(), now.rig_ns + static_cast<std::int64_t>(1e6 * now.bound_ms) + 1);
    EXPECT_GE(now.rig_ns, last_ns);
    last_ns = now.rig_ns;
  }
  EXPECT_FALSE(clock.problem());
  // Each reading is true: what it says lies within the bounds that the others made.
  const auto stub = v1::ClockService::NewStub(service.channel);
  for (int i = 0; i < 200; ++i) {
    const v1::ExchangeResponse answer = answer_of(*stub, &v1::ClockService::Stub::Exchange);
    ASSERT_TRUE(answer.has_rig());
    const client::RigTime begun = clock.to_rig(answer.rig().begun_ns());
    const client::RigTime done = clock.to_rig(answer.rig().done_ns());
    EXPECT_GE(answer.rig().rig_time_ns(), begun.rig_ns - static_cast<std::int64_t>(1e6 * begun.bound_ms) - 1);
    EXPECT_LE(answer.rig().rig_time_ns(), done.rig_ns + static_cast<std::int64_t>(1e6 * done.bound_ms) + 1);
  }
}

TEST(ClockService, ARigWithATimeOfItsOwnHasNoRigTime) {
  const TemporaryFolder folder;
  server::DaemonConfig simulated = quiet_config();
  simulated.simulation.real_time = false;
  const server::DaemonConfig replayed = config_that_replays(
      folder.write("run.csv", "time_s,force_N,position_mm\n0,0,0\n1,0,1\n2,1,2\n3,0,0\n"));
  for (const server::DaemonConfig& config : {simulated, replayed}) {
    const RunningService service(config);
    service.await([](const v1::RigState& state) { return state.tick() > 10; });
    client::Client client = clock_client(service.address());
    const client::ClockSync clock(client);
    await_exchanges(clock, 20);
    EXPECT_THROW(clock.to_rig(client::ClockSync::now_ns()), client::Error);
    EXPECT_NO_THROW(clock.to_daemon(client::ClockSync::now_ns()));
    EXPECT_FALSE(clock.problem());
    EXPECT_FALSE(clock.rig_problem());
    EXPECT_LE(clock.bounds().lower_ns, 0);
    EXPECT_GE(clock.bounds().upper_ns, 0);
  }
}

/// A daemon whose rig goes back by a second with each exchange.
class DaemonOfALeapingRig final : public v1::ClockService::Service {
 public:
  DaemonOfALeapingRig() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  grpc::Status Exchange(grpc::ServerContext* /*context*/, const v1::ExchangeRequest* request,
                        v1::ExchangeResponse* response) override {
    const std::int64_t now_ns = client::ClockSync::now_ns();
    response->set_client_sent_ns(request->client_sent_ns());
    response->set_daemon_received_ns(now_ns);
    response->set_daemon_sent_ns(now_ns);
    response->set_clock("machine");
    v1::RigReading& rig = *response->mutable_rig();
    rig.set_rig_time_ns(now_ns - 1'000'000'000 * ++exchanges_);
    rig.set_begun_ns(now_ns);
    rig.set_done_ns(now_ns);
    rig.set_clock("rig");
    return grpc::Status::OK;
  }

  int port_ = 0;
  std::atomic<std::int64_t> exchanges_{0};
  std::unique_ptr<grpc::Server> server_;
};

TEST(ClockService, ARigThatCannotBeFollowedLosesNoOffset) {
  const DaemonOfALeapingRig daemon;
  client::Client client = clock_client(daemon.address());
  const client::ClockSync clock(client);
  await_exchanges(clock, 12);  // the second round is over
  EXPECT_TRUE(clock.rig_problem());
  EXPECT_FALSE(clock.problem());
  EXPECT_LE(clock.bounds().lower_ns, 0);
  EXPECT_GE(clock.bounds().upper_ns, 0);
}

TEST(ClockService, NeedsADaemon) {
  auto service = std::make_unique<RunningService>();
  client::Client client = clock_client(service->address());
  service.reset();
  EXPECT_THROW(client::ClockSync{client}, client::Error);
}

#ifdef HAPTICCTL_BINARY  // where hapticctl is built
TEST(ClockService, TheCommandShowsIt) {
  const RunningService service;
  ChildProcess command(HAPTICCTL_BINARY, {"--server", service.address(), "clock", "--seconds", "0.2"});
  EXPECT_EQ(command.wait(), 0);
}
#endif

}  // namespace
}  // namespace hapticd::test
