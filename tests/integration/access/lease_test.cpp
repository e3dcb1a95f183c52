// Exclusive control, over the network.

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/turntable.grpc.pb.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/support/child_process.h"
#include "tests/support/eventually.h"

namespace hapticd::test {
namespace {

server::DaemonConfig config_without_notice() {
  server::DaemonConfig config = quiet_config();
  config.access.take_notice_s = 0.0;
  return config;
}

TEST(LeaseService, RefusesTheCommandsOfOthersAndNamesItsHolder) {
  const RunningService service(config_without_notice());
  ASSERT_TRUE(service.load("tap_1d").ok());
  AccessClient holder(connect(service.address()));
  AccessClient other(connect(service.address()));
  v1::AcquireLeaseRequest request;
  request.set_purpose("calibration");
  ASSERT_TRUE(holder.acquire(request).ok());
  EXPECT_TRUE(holder.set(0.3).ok());
  const grpc::Status refused = other.set(0.4);
  expect_refused_for(refused, grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_LEASE_HELD);
  EXPECT_NE(detail_of(refused).what().find("calibration"), std::string::npos);
  EXPECT_EQ(detail_of(other.acquire()).reason(), v1::ERROR_REASON_LEASE_HELD);
  EXPECT_TRUE(other.stop().ok()) << "all may stop";
  v1::ClearResponse cleared;
  EXPECT_TRUE(other.safety->Clear(call_context().get(), {}, &cleared).ok()) << "the holder's own user";
  EXPECT_TRUE(holder.safety->Clear(holder.context().get(), {}, &cleared).ok());
  EXPECT_TRUE(holder.give_back().ok());
  EXPECT_TRUE(other.set(0.4).ok());
}

TEST(LeaseService, NeedsOneWhereItIsRequired) {
  server::DaemonConfig config = quiet_config();
  config.access.lease = server::LeaseRule::kRequired;
  config.scene = "tap_1d";
  const RunningService service(config);
  AccessClient client(connect(service.address()));
  EXPECT_EQ(detail_of(client.set(0.3)).reason(), v1::ERROR_REASON_LEASE_REQUIRED);
  ASSERT_TRUE(client.acquire().ok());
  EXPECT_TRUE(client.set(0.3).ok());
}

TEST(LeaseService, WatchersHearOfEachChange) {
  const RunningService service(config_without_notice());
  AccessClient holder(connect(service.address()));
  AccessClient taker(connect(service.address()));
  const auto context = call_context();
  const auto stream = taker.lease->WatchLease(context.get(), {});
  v1::LeaseState state;
  ASSERT_TRUE(stream->Read(&state));
  EXPECT_EQ(state.change(), v1::LEASE_CHANGE_NONE);
  ASSERT_TRUE(holder.acquire().ok());
  ASSERT_TRUE(stream->Read(&state));
  EXPECT_EQ(state.change(), v1::LEASE_CHANGE_ACQUIRED);
  ASSERT_TRUE(taker.take().ok());
  ASSERT_TRUE(stream->Read(&state));
  EXPECT_EQ(state.change(), v1::LEASE_CHANGE_TAKEN);
  EXPECT_EQ(state.reason(), "it is my turn");
  ASSERT_TRUE(taker.give_back().ok());
  ASSERT_TRUE(stream->Read(&state));
  EXPECT_FALSE(state.has_lease());
  context->TryCancel();
  stream->Finish();
}

TEST(LeaseService, RefusesTermsThatCannotBe) {
  const RunningService service;
  AccessClient client(connect(service.address()));
  for (const double ttl_s : {0.0, 0.5, 61.0, -1.0}) {
    v1::AcquireLeaseRequest request;
    request.set_ttl_s(ttl_s);
    EXPECT_EQ(client.acquire(request).error_code(), grpc::StatusCode::OUT_OF_RANGE) << ttl_s;
  }
  v1::LeaseGrant grant;
  EXPECT_EQ(client.lease->TakeLease(call_context().get(), {}, &grant).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT)
      << "without a reason";
}

TEST(LeaseService, WhatWaitsForItsTimeIsLostWithTheLease) {
  const RunningService service(config_without_notice());
  ASSERT_TRUE(service.load("tap_1d").ok());
  AccessClient holder(connect(service.address()));
  AccessClient taker(connect(service.address()));
  ASSERT_TRUE(holder.acquire().ok());
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(0.9);
  request.set_at_time_ns(holder.state().time_ns() + 30'000'000'000);
  v1::SetTargetResponse response;
  grpc::Status status;
  std::atomic<bool> sent{false};
  std::thread waiting([&] {
    sent = true;
    status = holder.rendering->SetTarget(holder.context().get(), request, &response);
  });
  while (!sent) std::this_thread::yield();
  ASSERT_TRUE(taker.take().ok());
  waiting.join();
  expect_refused_for(status, grpc::StatusCode::ABORTED, v1::ERROR_REASON_LEASE_LOST);
  EXPECT_NE(detail_of(status).what().find("was taken by"), std::string::npos) << detail_of(status).what();
}

/// One race: the holder sets targets without pause while another takes the lease. What was reported to the
/// holder as applied must have taken effect before the second tick after the last one reported to the taker.
TEST(LeaseService, NothingOfTheOldHolderTakesEffectAfterATake) {
  server::DaemonConfig config = config_without_notice();
  config.loop.rate_hz = 5000.0;
  const RunningService service(config);
  ASSERT_TRUE(service.load("tap_1d").ok());
  constexpr int kRaces = 1000;
  AccessClient a(connect(service.address()));
  AccessClient b(connect(service.address()));
  AccessClient* holder = &a;
  AccessClient* taker = &b;
  ASSERT_TRUE(holder->acquire().ok());
  int violations = 0;
  int lost = 0;
  for (int race = 0; race < kRaces; ++race) {
    std::atomic<bool> taken{false};
    std::atomic<int> sent{0};
    std::uint64_t last_effect = 0;
    std::thread setting([&] {
      while (!taken) {
        v1::SetTargetResponse response;
        ++sent;
        const grpc::Status status = holder->set(0.3, &response);
        if (status.ok()) last_effect = std::max<std::uint64_t>(last_effect, response.effective_tick());
        if (!status.ok()) ++lost;
      }
    });
    while (sent == 0) std::this_thread::yield();
    v1::LeaseGrant granted;
    EXPECT_TRUE(taker->take(&granted).ok());
    taken = true;
    setting.join();
    if (last_effect > granted.changed_after_tick() + 1) ++violations;
    std::swap(holder, taker);
  }
  EXPECT_EQ(violations, 0);
  EXPECT_GT(lost, kRaces / 10) << "the take must meet commands that are under way";
}

TEST(LeaseService, AnIdentificationEndsWithItsLease) {
  const RunningService service(config_without_notice());
  AccessClient holder(connect(service.address()));
  AccessClient taker(connect(service.address()));
  ASSERT_TRUE(holder.acquire().ok());
  const auto identification = v1::IdentificationService::NewStub(service.channel);
  v1::StartIdentificationRequest request;
  request.mutable_tool();
  v1::StartIdentificationResponse started;
  ASSERT_TRUE(ok(identification->StartIdentification(holder.context().get(), request, &started)));
  ASSERT_TRUE(taker.take().ok());
  v1::WatchIdentificationRequest watched;
  watched.set_identification(started.identification());
  const auto context = call_context();
  const auto stream = identification->WatchIdentification(context.get(), watched);
  v1::IdentificationProgress progress;
  EXPECT_TRUE(ok(read_all(*stream, progress)));
  EXPECT_EQ(progress.state(), v1::IDENTIFICATION_STATE_CANCELLED);
  EXPECT_NE(progress.problem().what().find("was taken by"), std::string::npos) << progress.ShortDebugString();
}

TEST(LeaseService, AMotionOfTheTableEndsWithItsLease) {
  server::DaemonConfig config = config_with_table({{"a", 0.0, ""}, {"b", 170.0, ""}});
  config.access.take_notice_s = 0.0;
  const RunningService service(config);
  AccessClient holder(connect(service.address()));
  AccessClient taker(connect(service.address()));
  ASSERT_TRUE(holder.acquire().ok());
  const auto table = v1::TurntableService::NewStub(service.channel);
  v1::TurntableStatus now;
  const auto homing = holder.context();
  ASSERT_TRUE(ok(read_all(*table->Home(homing.get(), {}), now)));
  v1::MoveToRequest request;
  request.set_station("b");
  request.set_speed_deg_per_s(1.0);
  const auto moving = holder.context();
  const auto motion = table->MoveTo(moving.get(), request);
  ASSERT_TRUE(motion->Read(&now));
  ASSERT_TRUE(taker.take().ok());
  EXPECT_EQ(detail_of(read_all(*motion, now)).reason(), v1::ERROR_REASON_LEASE_LOST);
}

TEST(LeaseService, TheForceOfALostHolderRampsToZeroAndStaysOff) {
  const RunningService service(config_without_notice());
  ASSERT_TRUE(service.load("tap_1d").ok());
  AccessClient holder(connect(service.address()));
  v1::AcquireLeaseRequest request;
  request.set_ttl_s(1.0);
  request.set_on_expiry(v1::LEASE_EXPIRY_RAMP_TO_ZERO);
  ASSERT_TRUE(holder.acquire(request).ok());
  EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_CLIENT_LOST);
  EXPECT_EQ(holder.lease_state().change(), v1::LEASE_CHANGE_EXPIRED);
  EXPECT_EQ(detail_of(holder.set(0.3)).reason(), v1::ERROR_REASON_LEASE_LOST);
  EXPECT_TRUE(service.clear().ok()) << "any operator";
}

#ifdef HAPTICCTL_BINARY  // where hapticctl is built
TEST(LeaseService, AHolderWhoseProcessIsStoppedLosesIt) {
  const RunningService service(config_without_notice());
  ASSERT_TRUE(service.load("tap_1d").ok());
  service.press(2.0);
  const ChildProcess holder(HAPTICCTL_BINARY, {"--server", service.address(), "lease", "hold", "--ttl", "1",
                                               "--on-expiry", "ramp_to_zero", "--", "sleep", "10"});
  const AccessClient other(connect(service.address()));
  ASSERT_TRUE(eventually([&] { return other.lease_state().has_lease(); }));
  holder.signal(SIGSTOP);
  EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_CLIENT_LOST);
  EXPECT_EQ(other.lease_state().reason(), "not heard of for 1 s");
}

TEST(LeaseService, AHolderThatOnlyHoldsKeepsIt) {
  const RunningService service;
  ChildProcess holder(HAPTICCTL_BINARY,
                      {"--server", service.address(), "lease", "hold", "--ttl", "3", "--", "sleep", "4"});
  EXPECT_EQ(holder.wait(), 0);
  const AccessClient other(connect(service.address()));
  EXPECT_EQ(other.lease_state().change(), v1::LEASE_CHANGE_RETURNED) << "it was renewed, and given back";
}
#endif

}  // namespace
}  // namespace hapticd::test
