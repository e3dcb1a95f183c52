#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "hapticd/v1/identification.grpc.pb.h"
#include "hapticd/v1/turntable.grpc.pb.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/eventually.h"

namespace hapticd::test {
namespace {

/// A simulated table with three objects; slow enough for something to happen on the way.
server::DaemonConfig slow_table() {
  server::DaemonConfig config = config_with_table(
      {{"sponge", 0.0, "sponge_block"}, {"rubber", 90.0, "rubber_ball"}, {"bare", -90.0, ""}});
  config.turntable.settings.speed_deg_per_s = 120.0;
  config.turntable.settings.acceleration_deg_per_s2 = 480.0;
  config.turntable.sim.homing_deg_per_s = 120.0;
  return config;
}

v1::MoveToRequest to_station(const std::string& name) {
  v1::MoveToRequest request;
  request.set_station(name);
  return request;
}

v1::MoveToRequest to_angle(double angle_deg, double speed_deg_per_s = 0.0) {
  v1::MoveToRequest request;
  request.set_angle_deg(angle_deg);
  if (speed_deg_per_s > 0.0) request.set_speed_deg_per_s(speed_deg_per_s);
  return request;
}

class ServiceTurntable : public testing::Test {
 protected:
  ServiceTurntable() : service(slow_table()), table(v1::TurntableService::NewStub(service.channel)) {}

  v1::Turntable get() const { return answer_of(*table, &v1::TurntableService::Stub::GetTurntable); }
  /// A motion to its end: its status, and how often it was informed of.
  grpc::Status home() const {
    const auto context = call_context();
    v1::TurntableStatus last;
    return read_all(*table->Home(context.get(), {}), last);
  }
  grpc::Status move(const v1::MoveToRequest& request, v1::TurntableStatus* last = nullptr) const {
    const auto context = call_context();
    v1::TurntableStatus unused;
    return read_all(*table->MoveTo(context.get(), request), last != nullptr ? *last : unused);
  }
  /// Begins a slow motion and waits until the table has left its place.
  struct Motion {
    std::unique_ptr<grpc::ClientContext> context;
    std::unique_ptr<grpc::ClientReader<v1::TurntableStatus>> reader;
    v1::TurntableStatus last;
    grpc::Status finish() { return read_all(*reader, last); }
  };
  Motion set_off(double target_deg = 170.0) const {
    Motion motion;
    motion.context = call_context();
    motion.reader = table->MoveTo(motion.context.get(), to_angle(target_deg, 20.0));
    while (motion.reader->Read(&motion.last)) {
      if (motion.last.state() == v1::TURNTABLE_STATE_MOVING && motion.last.motion().completion() > 0.002)
        break;
    }
    EXPECT_EQ(motion.last.state(), v1::TURNTABLE_STATE_MOVING);
    return motion;
  }
  v1::Turntable await(v1::TurntableState state) const {
    v1::Turntable now;
    EXPECT_TRUE(eventually([&] { return (now = get()).status().state() == state; }));
    return now;
  }
  std::string object() const {
    const v1::SimulationInfo info =
        answer_of(*service.simulation, &v1::SimulationService::Stub::GetSimulation);
    return info.object();
  }

  RunningService service;
  std::unique_ptr<v1::TurntableService::Stub> table;
};

TEST_F(ServiceTurntable, TellsWhatThereIsWithoutOpeningIt) {
  const v1::Turntable info = get();
  EXPECT_EQ(info.name(), "sim:turntable");
  EXPECT_EQ(info.driver(), "sim");
  EXPECT_EQ(info.stations_size(), 3);
  EXPECT_EQ(info.stations(1).object(), "rubber_ball");
  EXPECT_EQ(info.status().state(), v1::TURNTABLE_STATE_IDLE);
  EXPECT_FALSE(info.status().has_position_deg());
  EXPECT_EQ(info.max_speed_deg_per_s(), 120.0);
}

TEST_F(ServiceTurntable, HomesGoesToAStationAndPutsItsObjectUnderTheTool) {
  const grpc::Status unhomed = move(to_station("rubber"));
  EXPECT_EQ(unhomed.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(unhomed).remedy(), "home it first");
  ASSERT_EQ(home().error_message(), "");
  EXPECT_EQ(get().status().station(), "sponge");
  EXPECT_EQ(object(), "sponge_block");

  v1::TurntableStatus last;
  ASSERT_TRUE(ok(move(to_station("rubber"), &last)));
  EXPECT_EQ(last.motion().end(), v1::TURNTABLE_MOTION_END_ARRIVED);
  EXPECT_EQ(last.motion().completion(), 1.0);
  EXPECT_NEAR(last.position_deg(), 90.0, 0.2);
  EXPECT_EQ(get().status().station(), "rubber");
  EXPECT_EQ(object(), "rubber_ball");

  ASSERT_TRUE(move(to_angle(45.0)).ok());
  EXPECT_EQ(get().status().station(), "");
  EXPECT_EQ(object(), "none");
}

TEST_F(ServiceTurntable, RefusesWhatCannotBe) {
  expect_refused(move(to_station("ruber")), grpc::StatusCode::NOT_FOUND, v1::ERROR_REASON_NOT_FOUND,
                 "MoveToRequest.station");
  EXPECT_EQ(move(to_angle(200.0)).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(move(to_angle(std::numeric_limits<double>::quiet_NaN())).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(move({}).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(move(to_angle(0.0, 500.0)).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(get().status().state(), v1::TURNTABLE_STATE_IDLE);  // none of it needed the port
}

TEST_F(ServiceTurntable, ACancelledCallStopsTheTable) {
  ASSERT_EQ(home().error_message(), "");
  Motion motion = set_off();
  motion.context->TryCancel();
  EXPECT_EQ(motion.finish().error_code(), grpc::StatusCode::CANCELLED);
  const v1::Turntable now = await(v1::TURNTABLE_STATE_STANDING);
  EXPECT_EQ(now.status().motion().end(), v1::TURNTABLE_MOTION_END_STOPPED);
  EXPECT_LT(now.status().position_deg(), 160.0);
}

TEST_F(ServiceTurntable, ADeadlineThatPassesStopsTheTable) {
  ASSERT_EQ(home().error_message(), "");
  const auto context = call_context(std::chrono::milliseconds(700));
  v1::TurntableStatus last;
  EXPECT_EQ(read_all(*table->MoveTo(context.get(), to_angle(170.0, 20.0)), last).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(await(v1::TURNTABLE_STATE_STANDING).status().motion().end(), v1::TURNTABLE_MOTION_END_STOPPED);
}

TEST_F(ServiceTurntable, AnyoneMayStopIt) {
  ASSERT_EQ(home().error_message(), "");
  Motion motion = set_off();
  answer_of(*table, &v1::TurntableService::Stub::StopTurntable);
  expect_refused_saying(motion.finish(), grpc::StatusCode::ABORTED, "the motion was stopped");
  EXPECT_EQ(motion.last.motion().end(), v1::TURNTABLE_MOTION_END_STOPPED);
  ASSERT_TRUE(move(to_angle(0.0)).ok());  // and may be turned again
}

TEST_F(ServiceTurntable, WhileItTurnsScenesTargetsAndObjectsAreRefused) {
  ASSERT_EQ(home().error_message(), "");
  ASSERT_TRUE(service.load("tap_1d").ok());
  Motion motion = set_off();
  expect_refused_saying(service.load("wall"), grpc::StatusCode::FAILED_PRECONDITION,
                        "the turntable's motion is under way");
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(0.5);
  EXPECT_EQ(service.set_target(target).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  v1::SetObjectRequest object_request;
  object_request.set_name("rubber_ball");
  v1::SetObjectResponse object_response;
  EXPECT_EQ(
      service.simulation->SetObject(call_context().get(), object_request, &object_response).error_code(),
      grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(move(to_angle(0.0)).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  auto identification = v1::IdentificationService::NewStub(service.channel);
  v1::StartIdentificationRequest start;
  start.mutable_threshold();
  v1::StartIdentificationResponse started;
  EXPECT_EQ(identification->StartIdentification(call_context().get(), start, &started).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  motion.context->TryCancel();
  motion.finish();
  await(v1::TURNTABLE_STATE_STANDING);
  service.await([&](const v1::RigState&) { return service.set_target(target).ok(); });
}

TEST_F(ServiceTurntable, DoesNotTurnWhileTheToolIsInContact) {
  ASSERT_EQ(home().error_message(), "");
  ASSERT_TRUE(service.load("tap_1d").ok());
  service.press(2.0);
  EXPECT_TRUE(get().has_interlock());
  expect_refused(move(to_station("rubber")), grpc::StatusCode::FAILED_PRECONDITION,
                 "interlock of the turntable");
  EXPECT_EQ(get().status().state(), v1::TURNTABLE_STATE_STANDING);
  EXPECT_NEAR(get().status().position_deg(), 0.0, 0.2);
}

TEST_F(ServiceTurntable, DoesNotTurnUnderLoadEvenWithoutAScene) {
  ASSERT_EQ(home().error_message(), "");
  service.set_hand(v1::HAND_PROGRAM_KIND_PRESS, [](v1::HandProgram& press) {
    press.set_force_n(3.0);
    press.set_hold_s(-1.0);
  });
  // A first touch may bounce: until it is pressed for a while.
  int in_a_row = 0;
  EXPECT_TRUE(eventually([&] { return (in_a_row = get().has_interlock() ? in_a_row + 1 : 0) >= 100; }));
  expect_refused_saying(move(to_station("rubber")), grpc::StatusCode::FAILED_PRECONDITION,
                        "the tool is under load");
}

TEST_F(ServiceTurntable, ContactOnTheWayStopsItAtOnce) {
  ASSERT_EQ(home().error_message(), "");
  // The hand is reported before: while the table turns it is not to be reported anything.
  ASSERT_TRUE(service.load("tap_1d").ok());
  service.set_hand(v1::HAND_PROGRAM_KIND_PRESS, [](v1::HandProgram& press) {
    press.set_force_n(2.0);
    press.set_approach_mm_per_s(4.0);
    press.set_hold_s(-1.0);
  });
  v1::TurntableStatus last;
  const grpc::Status status = move(to_angle(170.0, 5.0), &last);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED) << status.error_message();
  EXPECT_EQ(detail_of(status).where(), "interlock of the turntable");
  EXPECT_EQ(last.motion().end(), v1::TURNTABLE_MOTION_END_FORBIDDEN);
  EXPECT_NE(detail_of(status).what().find("the tool is in contact"), std::string::npos)
      << status.error_message();
  // The contact is forgotten with the cut: pressed on, the scene waits until nothing touches the tool.
  service.await([](const v1::RigState& s) {
    return s.contact_reason() == v1::CONTACT_REASON_AWAITING_FREE && s.detection_force_n() > 1.0;
  });
  EXPECT_EQ(get().status().state(), v1::TURNTABLE_STATE_STANDING);
  EXPECT_LT(get().status().position_deg(), 169.0);
}

TEST_F(ServiceTurntable, IsLetGoAndEngagedAgain) {
  v1::TurntableStatus status = answer_of(*table, &v1::TurntableService::Stub::Engage);
  EXPECT_EQ(status.state(), v1::TURNTABLE_STATE_NOT_HOMED);
  ASSERT_TRUE(table->Disengage(call_context().get(), {}, &status).ok());
  EXPECT_EQ(status.state(), v1::TURNTABLE_STATE_IDLE);
  ASSERT_EQ(home().error_message(), "");
}

TEST_F(ServiceTurntable, ADaemonThatEndsStopsTheTable) {
  ASSERT_EQ(home().error_message(), "");
  Motion motion = set_off();
  std::thread([this] { service.daemon->shutdown(); }).join();
  EXPECT_FALSE(motion.finish().ok());
}

TEST(ServiceWithoutTurntable, SaysSo) {
  const RunningService service;
  auto table = v1::TurntableService::NewStub(service.channel);
  const auto expect_none = [](const grpc::Status& status) {
    expect_refused(status, grpc::StatusCode::FAILED_PRECONDITION, "turntable");
  };
  v1::Turntable info;
  expect_none(table->GetTurntable(call_context().get(), {}, &info));
  v1::TurntableStatus status;
  expect_none(table->StopTurntable(call_context().get(), {}, &status));
  const auto context = call_context();
  expect_none(read_all(*table->Home(context.get(), {}), status));
}

}  // namespace
}  // namespace hapticd::test
